// Findings about a report's page as it is laid out now, in words; an expression that the browser evaluates.
(() => {
  const findings = [];
  const round = (rect) => [rect.left, rect.top, rect.right, rect.bottom].map(Math.round).join(" ");
  const name = (element) => element.tagName.toLowerCase() + (element.id ? "#" + element.id : "");
  const numbers = (colour) => (colour.match(/[\d.]+/g) || []).map(Number);

  // Nothing wider than the page, and nothing cut by its own box unless it scrolls.
  const page = document.documentElement;
  if (page.scrollWidth > page.clientWidth) findings.push(`page scrolls sideways: ${page.scrollWidth} of ${page.clientWidth} pixels`);
  for (const element of document.querySelectorAll("body *:not(svg *)")) {
    const scrolls = ["auto", "scroll"].includes(getComputedStyle(element).overflowX);
    if (!scrolls && element.clientWidth > 0 && element.scrollWidth > element.clientWidth + 1) {
      findings.push(`cut: ${name(element)} in ${name(element.closest("[id]") || document.body)} needs ${element.scrollWidth} of ${element.clientWidth} pixels`);
    }
  }

  // Every figure has something drawn in it, and says what.
  const luminance = ([r, g, b]) => {
    const linear = [r, g, b].map((part) => (part / 255 <= 0.04045 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const back = luminance(numbers(getComputedStyle(document.body).backgroundColor));
  const AXES = ["#444A50", "#DDE1E5"];
  const isMark = (shape) => {
    const colours = [shape.getAttribute("fill"), shape.getAttribute("stroke")].filter((colour) => colour && colour !== "none");
    const box = shape.getBBox();
    return colours.some((colour) => !AXES.includes(colour)) && (box.width > 0 || box.height > 0);
  };
  for (const figure of document.querySelectorAll("figure")) {
    const id = figure.id;
    if (!(figure.querySelector("figcaption")?.textContent.trim().length > 20)) findings.push(`${id}: no sentence`);
    if (figure.classList.contains("missing")) continue;
    const svg = figure.querySelector("svg");
    const marks = svg ? [...svg.querySelectorAll("circle,rect,polyline,path,polygon")] : [];
    const canvas = figure.querySelector("canvas");
    const shown = [svg, canvas].filter((drawing) => drawing && drawing.getBoundingClientRect().height > 100);
    if (shown.length !== 1) findings.push(`${id}: ${shown.length} drawings are shown`);
    if (shown[0] === svg && marks.filter(isMark).length < 1) findings.push(`${id}: nothing is drawn`);
    if (shown[0] === canvas && canvas) {
      const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      let drawn = 0;
      for (let i = 3; i < pixels.length; i += 4) drawn += pixels[i] > 0;
      if (drawn < 500) findings.push(`${id}: ${drawn} pixels are drawn`);
      if (canvas.width < canvas.clientWidth) findings.push(`${id}: ${canvas.width} pixels for ${canvas.clientWidth}`);
    }
    if (shown[0] !== svg) continue;

    // Words are within their drawing, apart from one another, large enough, and can be told from the page.
    const frame = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].filter((text) => text.textContent.trim());
    const boxes = texts.map((text) => text.getBoundingClientRect());
    texts.forEach((text, i) => {
      const [box, words] = [boxes[i], text.textContent.trim()];
      const SLACK = 1;
      if (box.left < frame.left - SLACK || box.right > frame.right + SLACK || box.top < frame.top - SLACK || box.bottom > frame.bottom + SLACK) {
        findings.push(`${id}: “${words}” is cut: ${round(box)} of ${round(frame)}`);
      }
      const size = parseFloat(getComputedStyle(text).fontSize) * frame.width / svg.viewBox.baseVal.width;
      if (size < 9) findings.push(`${id}: “${words}” is ${size.toFixed(1)} pixels high`);
      const difference = contrast(luminance(numbers(getComputedStyle(text).fill)), back);
      if (difference < 3) findings.push(`${id}: “${words}” has a contrast of ${difference.toFixed(1)}`);
      boxes.slice(0, i).forEach((other, j) => {
        const across = Math.min(box.right, other.right) - Math.max(box.left, other.left);
        const down = Math.min(box.bottom, other.bottom) - Math.max(box.top, other.top);
        // Boxes hold the room above and below letters, too.
        if (across > 1 && down > 0.4 * size) findings.push(`${id}: “${words}” is on “${texts[j].textContent.trim()}”`);
      });
    });
  }

  // Text of the page itself.
  for (const element of document.querySelectorAll("h1,h2,p,li,dt,dd,td,th,figcaption")) {
    if (!element.textContent.trim() || element.closest("svg")) continue;
    const difference = contrast(luminance(numbers(getComputedStyle(element).color)), back);
    if (difference < 3) findings.push(`${name(element)} “${element.textContent.trim().slice(0, 20)}” has a contrast of ${difference.toFixed(1)}`);
  }
  return { findings, dark: back < 0.2, figures: [...document.querySelectorAll("figure")].map((figure) => figure.id) };
})()
