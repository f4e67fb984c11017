// Drawing on canvases: ticks of axes, sharp canvases, lines and areas of points.

/** Round steps between ticks: 1, 2 or 5 times a power of ten. */
const tickStep = (span, count) => {
  const raw = span / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999);
};
const ticks = (low, high, count) => {
  const step = tickStep(high - low, count);
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) list.push(k * step);
  return { list, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
};

/** A canvas as sharp as the screen. */
const prepare = (canvas) => {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
};

const strokePoints = (context, points) => {
  context.beginPath();
  let drawing = false;
  for (const point of points) {
    if (!point) { drawing = false; continue; }
    if (drawing) context.lineTo(point[0], point[1]); else context.moveTo(point[0], point[1]);
    drawing = true;
  }
  context.stroke();
};

const fillPoints = (context, points) => {
  if (points.some((point) => !point)) return;
  context.beginPath();
  points.forEach((point, k) => (k ? context.lineTo(point[0], point[1]) : context.moveTo(point[0], point[1])));
  context.closePath();
  context.fill();
};

