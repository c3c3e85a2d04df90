"use strict";
// The poses in space, turned by mouse, finger or keys. Base frame, metres; z points up. The figure's SVG is the same view, still.
(() => {
  const figure = document.getElementById("scene");
  const canvas = figure && figure.querySelector("canvas");
  const context = canvas && canvas.getContext("2d");
  if (!context) return;
  const { points, chucks, wires, colours } = JSON.parse(figure.querySelector("script").textContent);
  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  const hue = (chuck) => colours[chuck % colours.length][dark.matches ? 1 : 0];
  const ink = () => (dark.matches ? "#eceef0" : "#15181b");

  const all = [...points.map((p) => p[0]), ...chucks.map((chuck) => chuck.at), ...wires.flatMap((wire) => wire.line)];
  const ends = [0, 1, 2].map((axis) => all.reduce(([low, high], p) => [Math.min(low, p[axis]), Math.max(high, p[axis])], [Infinity, -Infinity]));
  const middle = ends.map(([low, high]) => (low + high) / 2);
  const reach = all.reduce((far, p) => Math.max(far, Math.hypot(...p.map((x, axis) => x - middle[axis]))), 1e-6);
  const largest = points.reduce((most, p) => Math.max(most, Math.abs(p[2])), 1e-9);
  let turn = 0.7, tilt = 0.45; // the first view, radians; as in scene.rs
  let width = 1, height = 1;

  // Right and down on the canvas, in its pixels, and away from the eye.
  const project = (p) => {
    const [x, y, z] = [0, 1, 2].map((axis) => (p[axis] - middle[axis]) / reach);
    const across = x * Math.cos(turn) - y * Math.sin(turn);
    const away = x * Math.sin(turn) + y * Math.cos(turn);
    const scale = 0.46 * Math.min(width, height);
    return [width / 2 + across * scale, height / 2 - (z * Math.cos(tilt) + away * Math.sin(tilt)) * scale,
      away * Math.cos(tilt) - z * Math.sin(tilt)];
  };

  const path = (line, colour, alpha) => {
    context.globalAlpha = alpha;
    context.strokeStyle = colour;
    context.beginPath();
    line.forEach((p, i) => context[i ? "lineTo" : "moveTo"](...project(p).slice(0, 2)));
    context.stroke();
    context.globalAlpha = 1;
  };

  const label = (text, at) => {
    const [x, y] = project(at);
    context.fillStyle = ink();
    context.fillText(text, x + 8, y - 8);
  };

  // Setting a size clears the canvas: it is done just before drawing.
  const fit = () => {
    const sharpness = window.devicePixelRatio || 1;
    width = canvas.clientWidth || 1;
    height = canvas.clientHeight || 1;
    const pixels = [width, height].map((side) => Math.floor(side * sharpness));
    if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
    context.setTransform(sharpness, 0, 0, sharpness, 0, 0);
  };

  const draw = () => {
    fit();
    context.clearRect(0, 0, width, height);
    context.font = "14px system-ui, sans-serif";
    context.lineWidth = 1;
    wires.forEach((wire) => path(wire.line, hue(wire.chuck), 0.3));
    const origin = [0, 0, Math.min(...chucks.map((chuck) => chuck.at[2]))];
    ["x", "y", "z"].forEach((name, axis) => {
      const end = origin.map((value, i) => value + (i === axis ? reach * 0.25 : 0));
      path([origin, end], ink(), 1);
      label(name, end);
    });
    const dots = points.map((p) => [project(p[0]), p]).sort((a, b) => b[0][2] - a[0][2]);
    const size = Math.max(1, Math.min(width, height) / 300);
    context.globalAlpha = 0.65;
    for (const [[x, y], p] of dots) {
      context.fillStyle = hue(p[1]);
      context.beginPath();
      context.arc(x, y, size * (1.2 + 2.3 * Math.abs(p[2]) / largest), 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
    chucks.forEach((chuck, i) => {
      const [x, y] = project(chuck.at);
      context.fillStyle = hue(i);
      context.strokeStyle = ink();
      context.beginPath();
      context.rect(x - 5, y - 5, 10, 10);
      context.fill();
      context.stroke();
      label(chuck.name, chuck.at);
    });
  };

  // However many events there are between two frames, each frame is drawn once.
  let isAsked = false;
  const redraw = () => {
    if (isAsked) return;
    isAsked = true;
    requestAnimationFrame(() => {
      isAsked = false;
      draw();
    });
  };

  const turnBy = (right, down) => {
    turn += right;
    tilt = Math.max(-1.5, Math.min(1.5, tilt + down));
    redraw();
  };

  const RADIANS_A_PIXEL = 0.008, RADIANS_A_KEY = 0.1;
  let last = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    last = [event.clientX, event.clientY];
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    turnBy((event.clientX - last[0]) * RADIANS_A_PIXEL, (event.clientY - last[1]) * RADIANS_A_PIXEL);
    last = [event.clientX, event.clientY];
  });
  ["pointerup", "pointercancel"].forEach((name) => canvas.addEventListener(name, () => { last = null; }));
  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key]) return;
    event.preventDefault();
    turnBy(...keys[event.key].map((way) => way * RADIANS_A_KEY));
  });
  figure.classList.add("turns");
  new ResizeObserver(redraw).observe(canvas);
  dark.addEventListener("change", redraw);
  redraw();
})();
