"use strict";
// The poses in space, turned by dragging. Base frame, metres; z points up.
(() => {
  const figure = document.getElementById("scene");
  const canvas = figure.querySelector("canvas");
  const context = canvas.getContext("2d");
  const { points, chucks } = JSON.parse(figure.querySelector("script").textContent);
  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  const hue = (chuck) => `hsl(${(205 + 137 * chuck) % 360} 65% ${dark.matches ? 65 : 40}%)`;
  const ink = () => (dark.matches ? "#eceef0" : "#15181b");

  const all = points.map((p) => p.slice(0, 3)).concat(chucks.map((chuck) => chuck.at));
  const middle = [0, 1, 2].map((axis) => {
    const values = all.map((p) => p[axis]);
    return (values.reduce((a, b) => Math.min(a, b)) + values.reduce((a, b) => Math.max(a, b))) / 2;
  });
  const reach = all.reduce((far, p) => Math.max(far, Math.hypot(...p.map((x, axis) => x - middle[axis]))), 1e-6);
  const largest = points.reduce((most, p) => Math.max(most, Math.abs(p[4])), 1e-9);
  let turn = 0.7, tilt = 0.45;

  const project = (p) => {
    const [x, y, z] = [0, 1, 2].map((axis) => (p[axis] - middle[axis]) / reach);
    const across = x * Math.cos(turn) - y * Math.sin(turn);
    const away = x * Math.sin(turn) + y * Math.cos(turn);
    const scale = canvas.height * 0.47;
    return [canvas.width / 2 + across * scale, canvas.height / 2 - (z * Math.cos(tilt) + away * Math.sin(tilt)) * scale,
      away * Math.cos(tilt) - z * Math.sin(tilt)];
  };

  const label = (text, at, colour) => {
    const [x, y] = project(at);
    context.fillStyle = colour;
    context.fillText(text, x + 10, y - 10);
  };

  const draw = () => {
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.font = "26px system-ui, sans-serif";
    const origin = [0, 0, Math.min(...chucks.map((chuck) => chuck.at[2]))];
    ["x", "y", "z"].forEach((name, axis) => {
      const end = origin.map((value, i) => value + (i === axis ? reach * 0.3 : 0));
      context.strokeStyle = ink();
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(...project(origin).slice(0, 2));
      context.lineTo(...project(end).slice(0, 2));
      context.stroke();
      label(name, end, ink());
    });
    const dots = points.map((p) => [project(p), p]).sort((a, b) => b[0][2] - a[0][2]);
    for (const [[x, y], p] of dots) {
      context.globalAlpha = 0.65;
      context.fillStyle = hue(p[3]);
      context.beginPath();
      context.arc(x, y, 3 + 7 * Math.abs(p[4]) / largest, 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
    chucks.forEach((chuck, i) => {
      const [x, y] = project(chuck.at);
      context.fillStyle = hue(i);
      context.strokeStyle = ink();
      context.beginPath();
      context.rect(x - 9, y - 9, 18, 18);
      context.fill();
      context.stroke();
      label(chuck.name, chuck.at, ink());
    });
    canvas.dataset.drawn = String(dots.length);
  };

  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    turn += event.movementX * 0.008;
    tilt = Math.max(-1.5, Math.min(1.5, tilt + event.movementY * 0.008));
    draw();
  });
  dark.addEventListener("change", draw);
  addEventListener("beforeprint", draw);
  draw();
})();
