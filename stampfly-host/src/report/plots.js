// Plots and bands on one time axis, with cursor, hover line and zoom.

const LEFT = 66, RIGHT = 12, TOP = 6, BOTTOM = 6;
const areas = []; // Everything with the shared time axis.

/** Cursor, hover line and pointer handling common to plots and bands. */
const makeArea = (parent, height, left, draw) => {
  const node = make('div', parent, 'area');
  if (height) node.style.height = `${height}px`;
  const canvas = make('canvas', node);
  const range = make('div', node, 'range');
  const hover = make('div', node, 'hover');
  const cursor = make('div', node, 'cursor');
  range.hidden = hover.hidden = true;
  const area = { node, canvas, draw, left, visible: false, stale: true };
  area.span = () => Math.max(node.clientWidth - left - RIGHT, 1);
  area.x = (time) => left + ((time - state.from) / (state.to - state.from)) * area.span();
  area.timeAt = (x) => state.from + (clamp(x - left, 0, area.span()) / area.span()) * (state.to - state.from);
  const place = (line, time) => {
    const shown = time !== null && time >= state.from && time <= state.to;
    line.hidden = !shown;
    if (shown) line.style.transform = `translateX(${area.x(time)}px)`;
  };
  area.update = () => {
    place(cursor, state.time);
    place(hover, state.hover);
  };
  let pressed = null;
  const local = (event) => event.clientX - node.getBoundingClientRect().left;
  node.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    pressed = local(event);
    if (event.pointerType === 'mouse') node.setPointerCapture(event.pointerId);
    else setTime(area.timeAt(pressed));
  });
  node.addEventListener('pointermove', (event) => {
    const x = local(event);
    state.hover = area.timeAt(x);
    if (pressed !== null && event.pointerType !== 'mouse') setTime(state.hover);
    if (pressed !== null && event.pointerType === 'mouse' && Math.abs(x - pressed) > 4) {
      range.hidden = false;
      const [a, b] = [Math.min(x, pressed), Math.max(x, pressed)].map((v) => clamp(v, left, left + area.span()));
      range.style.left = `${a}px`;
      range.style.width = `${b - a}px`;
    }
    refresh();
  });
  const release = (event) => {
    if (pressed === null) return;
    const [from, to] = [pressed, local(event)].sort((a, b) => a - b).map(area.timeAt);
    const dragged = !range.hidden;
    pressed = null;
    range.hidden = true;
    if (dragged && to - from > 4 * data.step) setView(from, to);
    else if (!dragged) setTime(from);
  };
  node.addEventListener('pointerup', release);
  node.addEventListener('pointercancel', () => { pressed = null; range.hidden = true; });
  node.addEventListener('pointerleave', () => { state.hover = null; refresh(); });
  node.addEventListener('dblclick', () => setView(data.start, end));
  areas.push(area);
  return area;
};

/** Lowest and highest value in view. */
const extent = (panel) => {
  let low = Infinity, high = -Infinity;
  const [first, last] = [indexAt(state.from), indexAt(state.to)];
  for (const line of panel.lines) {
    const values = channels[line.channel];
    for (let i = first; i <= last; i++) {
      const value = values[i];
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return [-1, 1];
  const least = Math.max(Math.abs(low), Math.abs(high)) * 1e-3 || 1e-3;
  if (high - low < least) [low, high] = [low - least, high + least];
  const margin = (high - low) * 0.07;
  return [low - margin, high + margin];
};

const FLOOR = 1e-3; // Test ratios below this are as good as zero.

const drawTimeGrid = (context, area, height, labels) => {
  const { list, digits } = ticks(state.from - data.start, state.to - data.start, Math.max(area.span() / 90, 2));
  context.strokeStyle = color('--grid');
  context.fillStyle = color('--dim');
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.font = '11px system-ui, sans-serif';
  context.beginPath();
  for (const time of list) {
    const x = Math.round(area.x(time + data.start)) + 0.5;
    context.moveTo(x, 0);
    context.lineTo(x, labels ? 4 : height);
    if (labels) context.fillText(`${time.toFixed(digits)} s`, clamp(x, area.left + 8, area.left + area.span() - 12), height / 2 + 2);
  }
  context.stroke();
};

const drawPanel = (panel, area) => {
  const { context, width, height } = prepare(area.canvas);
  drawTimeGrid(context, area, height, false);
  let [low, high] = extent(panel);
  const log = panel.logarithmic;
  if (log) [low, high] = [Math.log10(FLOOR), Math.log10(Math.max(high, 3))];
  const scale = (value) => (log ? Math.log10(Math.max(value, FLOOR)) : value);
  const y = (value) => height - BOTTOM - ((scale(value) - low) / (high - low)) * (height - TOP - BOTTOM);

  context.strokeStyle = color('--grid');
  context.fillStyle = color('--dim');
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  context.font = '11px system-ui, sans-serif';
  const marks = log ? { list: [0.001, 0.01, 0.1, 1, 10, 100, 1000].filter((v) => Math.log10(v) <= high) } : ticks(low, high, height / 22);
  for (const value of marks.list) {
    const at = Math.round(y(value)) + 0.5;
    context.beginPath();
    context.moveTo(area.left, at);
    context.lineTo(width - RIGHT, at);
    context.stroke();
    if (at < 5 || at > height - 4) continue;
    const text = log ? String(value) : fixed(value, marks.digits);
    context.fillText(text, area.left - 6, at);
  }
  if (panel.limit !== undefined) {
    context.strokeStyle = color('--bad');
    context.setLineDash([4, 4]);
    context.beginPath();
    context.moveTo(area.left, y(panel.limit));
    context.lineTo(width - RIGHT, y(panel.limit));
    context.stroke();
    context.setLineDash([]);
  }

  context.save();
  context.beginPath();
  context.rect(area.left, 0, area.span(), height);
  context.clip();
  context.lineJoin = 'round';
  // The estimate is drawn last and lies on top.
  // An angle that leaves at one end comes back at the other: that is no line.
  const jump = panel.unit === '°' ? 180 : Infinity;
  for (const line of [...panel.lines].reverse()) drawLine(context, area, line, y, jump);
  context.restore();
};

const drawLine = (context, area, line, y, jump) => {
  const values = channels[line.channel];
  const first = Math.max(indexAt(state.from) - 1, 0), last = Math.min(indexAt(state.to) + 1, data.points - 1);
  context.strokeStyle = color(variable(line.role));
  const dense = (last - first) / area.span() > 1.5;
  context.lineWidth = line.role === 'truth' ? 2.4 : dense ? 1.1 : 1.5;
  context.globalAlpha = line.role === 'truth' ? 0.75 : 1;
  context.setLineDash(line.role === 'setpoint' ? [6, 4] : []);
  context.beginPath();
  let drawing = false, column = NaN, low = 0, high = 0, lastY = 0;
  const flush = () => {
    if (Number.isNaN(column)) return;
    const x = column + 0.5;
    if (drawing) context.lineTo(x, y(low)); else context.moveTo(x, y(low));
    context.lineTo(x, y(high));
    context.lineTo(x, lastY);
    drawing = true;
    column = NaN;
  };
  for (let i = first; i <= last; i++) {
    const value = values[i];
    if (Number.isNaN(value)) {
      if (dense) flush();
      drawing = false;
      continue;
    }
    if (Math.abs(value - values[i - 1]) > jump) {
      if (dense) flush();
      drawing = false;
    }
    const x = area.x(data.start + i * data.step);
    if (!dense) {
      if (drawing) context.lineTo(x, y(value)); else context.moveTo(x, y(value));
      drawing = true;
      continue;
    }
    // More points than pixels: each column of pixels shows its lowest and highest value.
    if (Math.floor(x) !== column) {
      flush();
      column = Math.floor(x);
      low = high = value;
    }
    low = Math.min(low, value);
    high = Math.max(high, value);
    lastY = y(value);
  }
  if (dense) flush();
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
};

const readouts = []; // Values beside the titles, updated with the cursor.

const addPanel = (card, panel) => {
  const node = make('div', card, 'panel');
  const header = make('header', node);
  const title = make('b', header, '', `${panel.title} `);
  if (panel.unit) make('small', title, '', panel.unit);
  const values = make('div', header, 'values');
  for (const line of panel.lines) {
    const span = make('span', values);
    make('i', span).style.background = `var(${variable(line.role)})`;
    span.append(line.name);
    readouts.push({ output: make('b', span), line, node });
  }
  const area = makeArea(node, panel.lines.length > 3 ? 118 : 100, LEFT, () => drawPanel(panel, area));
};

const addTimeAxis = (card) => {
  const node = make('div', card, 'panel ticks');
  const area = makeArea(node, 20, LEFT, () => {
    const { context, height } = prepare(area.canvas);
    drawTimeGrid(context, area, height, true);
  });
};

const STATE_COLORS = ['--c7', '--c4', '--c6', '--c1', '--c3', '--c0', '--c2', '--c5'];

const drawBand = (band, area) => {
  const { context, height } = prepare(area.canvas);
  context.font = '11px system-ui, sans-serif';
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  for (const [from, to, name, code] of band.stretches) {
    if (to < state.from || from > state.to) continue;
    const a = clamp(area.x(from), area.left, area.left + area.span());
    const b = clamp(area.x(to), area.left, area.left + area.span());
    const fill = color(band.alert ? '--bad' : STATE_COLORS[code % STATE_COLORS.length]);
    context.globalAlpha = 0.22;
    context.fillStyle = fill;
    context.fillRect(a, 3, Math.max(b - a, 1.5), height - 6);
    context.globalAlpha = 1;
    context.fillRect(a, 3, 2, height - 6);
    const text = context.measureText(name).width;
    if (text + 12 < b - a) {
      context.fillStyle = color('--ink');
      context.fillText(name, a + 7, height / 2 + 0.5);
    }
  }
};

const buildPlots = () => {
  const plots = element('plots');
  if (data.bands.length) {
    make('h2', plots, '', 'State');
    const card = make('div', plots, 'card');
    const bands = make('div', card, 'bands');
    for (const band of data.bands) {
      const row = make('div', bands, 'row');
      make('label', row, '', band.title).title = band.title;
      const area = makeArea(row, 0, LEFT, () => drawBand(band, area));
    }
    if (data.events.length) {
      const list = make('ol', make('div', card, 'panel'));
      list.id = 'events';
      for (const [at, text] of data.events) {
        const item = make('li', list);
        make('time', item, '', clock(at));
        make('span', item, '', text);
        item.addEventListener('click', () => setTime(at));
      }
    }
  }
  let group = '', card = null;
  for (const panel of data.panels) {
    if (panel.group !== group) {
      if (card) addTimeAxis(card);
      group = panel.group;
      make('h2', plots, '', group);
      card = make('div', plots, 'card');
    }
    addPanel(card, panel);
  }
  if (card) addTimeAxis(card);
};

