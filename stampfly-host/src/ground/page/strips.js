// Plots that scroll: the last twenty seconds of a live vehicle, twenty seconds around the slider of a log.

const SPAN = 20;
const strips = { vehicle: null, list: [] };

const buildStrips = (vehicle) => {
  strips.vehicle = vehicle;
  element('strips').replaceChildren();
  strips.list = vehicle.plots.map((plot) => {
    const node = make('figure', element('strips'), 'strip');
    const caption = make('figcaption', node);
    make('b', caption, '', `${plot.title} `);
    make('small', caption, '', plot.unit);
    const values = make('span', caption, 'values');
    const outputs = plot.lines.map((line) => {
      const span = make('span', values);
      make('i', span).style.background = `var(${variable(line.role)})`;
      span.append(line.name);
      return make('b', span, '', '–');
    });
    const drawn = make('canvas', node);
    drawn.setAttribute('role', 'img');
    drawn.setAttribute('aria-label', `${plot.title}, the last twenty seconds`);
    return { plot, canvas: drawn, outputs };
  });
};

const drawStrips = (vehicle) => {
  if (strips.vehicle !== vehicle) buildStrips(vehicle);
  const now = vehicle.clock;
  const [from, to] = vehicle.isLog ? [now - SPAN / 2, now + SPAN / 2] : [now - SPAN, now];
  const first = Math.max(framesUntil(vehicle, from) - 1, 0), last = Math.min(framesUntil(vehicle, to) + 1, vehicle.times.length);
  for (const strip of strips.list) drawStrip(strip, vehicle, from, to, first, last, now);
};

const LEFT = 44, RIGHT = 8;

const drawStrip = ({ plot, canvas: drawn }, vehicle, from, to, first, last, now) => {
  const { context, width, height } = prepare(drawn);
  let low = Infinity, high = -Infinity;
  const columns = plot.lines.map((line) => vehicle.columns.get(line.key).values);
  for (const values of columns) {
    for (let index = first; index < last; index++) {
      const value = values[index];
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) [low, high] = [0, 1];
  const least = Math.max(plot.least, Math.abs(high) * 1e-3, 1e-3);
  if (high - low < least) [low, high] = [(low + high - least) / 2, (low + high + least) / 2];
  const margin = (high - low) * 0.08;
  [low, high] = [low - margin, high + margin];
  const x = (time) => LEFT + ((time - from) / (to - from)) * (width - LEFT - RIGHT);
  const y = (value) => 4 + ((high - value) / (high - low)) * (height - 20);
  context.font = '10.5px system-ui, sans-serif';
  context.fillStyle = color('--dim');
  context.strokeStyle = color('--grid');
  context.lineWidth = 1;
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  const marks = ticks(low, high, Math.max(height / 26, 2));
  for (const value of marks.list) {
    const at = Math.round(y(value)) + 0.5;
    strokePoints(context, [[LEFT, at], [width - RIGHT, at]]);
    context.fillText(fixed(value, marks.digits), LEFT - 5, at);
  }
  context.textAlign = 'center';
  context.textBaseline = 'alphabetic';
  for (let time = Math.ceil(from / 5) * 5; time <= to; time += 5) {
    if (time < 0) continue;
    strokePoints(context, [[Math.round(x(time)) + 0.5, 4], [Math.round(x(time)) + 0.5, height - 16]]);
    context.fillText(`${time} s`, clamp(x(time), LEFT + 8, width - 16), height - 4);
  }
  context.save();
  context.beginPath();
  context.rect(LEFT, 0, width - LEFT - RIGHT, height - 15);
  context.clip();
  context.lineJoin = 'round';
  plot.lines.map((line, index) => [line, columns[index]]).reverse().forEach(([line, values]) => {
    context.strokeStyle = color(variable(line.role));
    context.lineWidth = line.role === 'truth' ? 2.2 : 1.5;
    context.globalAlpha = line.role === 'truth' ? 0.7 : 1;
    context.setLineDash(line.role === 'setpoint' ? [5, 4] : []);
    const points = [];
    for (let index = first; index < last; index++) {
      points.push(Number.isFinite(values[index]) ? [x(vehicle.times[index]), y(values[index])] : null);
    }
    strokePoints(context, points);
  });
  context.restore();
  if (vehicle.isLog) {
    context.strokeStyle = color('--accent');
    strokePoints(context, [[x(now), 0], [x(now), height - 15]]);
  }
};

/** Numbers beside the titles, a few times a second: faster than that nobody reads. */
const writeStrips = (vehicle) => {
  if (strips.vehicle !== vehicle) return;
  for (const { plot, outputs } of strips.list) {
    plot.lines.forEach((line, index) => {
      const value = line.get();
      const digits = Math.abs(value) >= 30 ? 0 : plot.unit === '°' ? 1 : 2;
      outputs[index].textContent = number(value, digits);
    });
  }
};

