'use strict';
// Draws what the page's data say. Three parts: the data, the plots, the space.
(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const element = (id) => document.getElementById(id);
  const make = (tag, parent, className = '', text = '') => {
    const node = document.createElement(tag);
    if (className) node.className = className;
    if (text) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  // ---- Data -------------------------------------------------------------------------------------------------

  const NO_VALUE = 65535;
  const channels = data.channels.map(({ low, step, codes }) => {
    const bytes = atob(codes);
    const values = new Float32Array(bytes.length / 2);
    for (let i = 0; i < values.length; i++) {
      const code = bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8);
      values[i] = code === NO_VALUE ? NaN : low + step * code;
    }
    return values;
  });
  const duration = Math.max((data.points - 1) * data.step, data.step);
  const end = data.start + duration;
  const indexAt = (time) => clamp(Math.round((time - data.start) / data.step), 0, data.points - 1);
  const valueAt = (channel, time) => channels[channel][indexAt(time)];

  const state = { time: data.start, from: data.start, to: end, hover: null, playing: false, speed: 1, follow: false };
  const HINT = 'drag in a plot to zoom · click to set the time · space plays';
  const SPEEDS = [1, 2, 4, 0.25, 0.5];

  let styles = getComputedStyle(document.documentElement);
  const ROLES = ['estimate', 'truth', 'setpoint', 'device', 'range'];
  const variable = (role) => (ROLES.includes(role) ? `--${role}` : `--c${Number(role) % 8}`);
  const color = (name) => styles.getPropertyValue(name).trim();

  /** As many decimals as a channel's largest value deserves, so that a read-out does not jump. */
  const decimals = channels.map((values) => {
    let size = 0;
    for (const value of values) if (Math.abs(value) > size) size = Math.abs(value);
    return size >= 1000 ? 0 : size >= 30 ? 1 : size >= 3 ? 2 : 3;
  });
  const fixed = (value, digits) => value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1').replace('-', '−');
  const number = (value, digits) => (Number.isFinite(value) ? fixed(value, digits) : '–');
  const clock = (time) => `${(time - data.start).toFixed(2)} s`;

  // ---- Plots ------------------------------------------------------------------------------------------------

  const LEFT = 66, RIGHT = 12, TOP = 6, BOTTOM = 6;
  const areas = []; // Everything with the shared time axis.

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
    for (const line of [...panel.lines].reverse()) drawLine(context, area, line, y);
    context.restore();
  };

  const drawLine = (context, area, line, y) => {
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

  // ---- Space ------------------------------------------------------------------------------------------------

  const canvas = element('space');
  const primary = data.scene.find((actor) => actor.role !== 'setpoint');
  const paths = data.scene.filter((actor) => actor.position);

  /** The box around every path, NED. */
  const bounds = (() => {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const actor of paths) {
      actor.position.forEach((channel, axis) => {
        for (const value of channels[channel]) {
          if (value < low[axis]) low[axis] = value;
          if (value > high[axis]) high[axis] = value;
        }
      });
    }
    for (let axis = 0; axis < 3; axis++) if (low[axis] > high[axis]) [low[axis], high[axis]] = [-0.5, 0.5];
    return { low, high, ground: Math.max(high[2], 0) };
  })();
  const size = Math.max(bounds.high[0] - bounds.low[0], bounds.high[1] - bounds.low[1], (bounds.ground - bounds.low[2]) * 1.2, 0.6);
  const middle = [0, 1].map((axis) => (bounds.low[axis] + bounds.high[axis]) / 2).concat((bounds.low[2] + bounds.ground) / 2);
  const HOME = { turn: -2.25, tilt: 0.42, distance: size * 1.42 };
  const camera = { ...HOME, target: [...middle] };

  /** Camera coordinates of a point: right, up, depth. */
  const makeProjection = (width, height) => {
    const [st, ct] = [Math.sin(camera.turn), Math.cos(camera.turn)];
    const [si, ci] = [Math.sin(camera.tilt), Math.cos(camera.tilt)];
    const focal = Math.min(width, height * 1.25) * 1.05;
    return (point) => {
      const n = point[0] - camera.target[0], e = point[1] - camera.target[1], u = camera.target[2] - point[2];
      // From above, east lies to the right of north.
      const ahead = n * ct + e * st, right = -n * st + e * ct;
      const depth = camera.distance + ahead * ci - u * si;
      if (depth < camera.distance * 0.02) return null;
      const up = ahead * si + u * ci;
      return [width / 2 + (right * focal) / depth, height * 0.52 - (up * focal) / depth, depth];
    };
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

  const positionAt = (actor, index) => {
    if (!actor.position) return [0, 0, 0];
    const point = actor.position.map((channel) => channels[channel][index]);
    return point.some(Number.isNaN) ? null : point;
  };

  const drawPath = (context, project, actor, from, to) => {
    const stride = Math.max(1, Math.floor((to - from) / 2500));
    const points = [];
    for (let i = from; i <= to; i += stride) {
      const point = positionAt(actor, i);
      points.push(point && project(point));
    }
    const last = positionAt(actor, to);
    points.push(last && project(last));
    strokePoints(context, points);
  };

  const drawGround = (context, project) => {
    const step = tickStep(size * 2.2, 12);
    const reach = Math.ceil((size * 1.1) / step) * step;
    const center = [Math.round(middle[0] / step) * step, Math.round(middle[1] / step) * step];
    context.lineWidth = 1;
    for (let k = -Math.round(reach / step); k <= Math.round(reach / step); k++) {
      for (const axis of [0, 1]) {
        const a = [0, 0, bounds.ground], b = [0, 0, bounds.ground];
        a[axis] = b[axis] = center[axis] + k * step;
        a[1 - axis] = center[1 - axis] - reach;
        b[1 - axis] = center[1 - axis] + reach;
        const origin = Math.abs(a[axis]) < step * 0.01;
        context.strokeStyle = color(origin ? '--line' : '--grid');
        context.lineWidth = origin ? 1.6 : 1;
        strokePoints(context, [project(a), project(b)]);
      }
    }
    context.font = '12px system-ui, sans-serif';
    context.fillStyle = color('--dim');
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    const names = [['N', [center[0] + reach * 1.05, center[1]]], ['E', [center[0], center[1] + reach * 1.05]]];
    for (const [name, [n, e]] of names) {
      const at = project([n, e, bounds.ground]);
      if (at) context.fillText(name, at[0], at[1]);
    }
    return step;
  };

  /** Body FRD to world with the quaternion w, x, y, z. */
  const rotate = ([w, x, y, z], [a, b, c]) => {
    const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
    return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
  };

  const ARM = 0.0325; // Metres from the middle to a motor, along each axis.
  const PROPELLER = 0.0157;

  const attitudeAt = (actor, index) => {
    const q = actor.attitude ? actor.attitude.map((channel) => channels[channel][index]) : [1, 0, 0, 0];
    return q.some(Number.isNaN) ? null : q;
  };

  const drawVehicle = (context, project, actor, index, scale, ghost) => {
    const place = positionAt(actor, index), q = attitudeAt(actor, index);
    if (!place || !q) return;
    const world = (point) => {
      const turned = rotate(q, point.map((value) => value * scale));
      return turned.map((value, axis) => value + place[axis]);
    };
    const main = color(variable(actor.role)), ink = color('--ink');
    context.globalAlpha = ghost ? 0.5 : 1;

    if (!ghost) {
      // A plumb line and a shadow tell where in space the vehicle is.
      const foot = [place[0], place[1], bounds.ground];
      context.strokeStyle = color('--dim');
      context.setLineDash([2, 4]);
      context.lineWidth = 1;
      strokePoints(context, [project(place), project(foot)]);
      context.setLineDash([]);
      context.fillStyle = color('--dim');
      context.globalAlpha = 0.25;
      const shadow = [];
      for (let k = 0; k <= 24; k++) {
        const angle = (k / 24) * 2 * Math.PI;
        shadow.push(project([foot[0] + 1.2 * ARM * scale * Math.cos(angle), foot[1] + 1.2 * ARM * scale * Math.sin(angle), foot[2]]));
      }
      fillPoints(context, shadow);
      context.globalAlpha = 1;
    }

    const motors = [[ARM, ARM], [-ARM, ARM], [-ARM, -ARM], [ARM, -ARM]];
    const parts = [];
    const HEIGHT = -0.008;
    for (const [forward, right] of motors) {
      const ring = [];
      for (let k = 0; k <= 28; k++) {
        const angle = (k / 28) * 2 * Math.PI;
        ring.push(project(world([forward + PROPELLER * 1.35 * Math.cos(angle), right + PROPELLER * 1.35 * Math.sin(angle), HEIGHT])));
      }
      const hub = project(world([forward, right, HEIGHT]));
      const root = project(world([0, 0, 0]));
      if (!hub || !root) continue;
      parts.push({ depth: hub[2], paint: () => {
        context.strokeStyle = ink;
        context.lineWidth = ghost ? 1 : 2.6;
        strokePoints(context, [root, hub]);
        context.fillStyle = forward > 0 ? main : ink;
        context.globalAlpha = ghost ? 0.12 : forward > 0 ? 0.5 : 0.22;
        fillPoints(context, ring);
        context.globalAlpha = ghost ? 0.5 : 1;
        context.strokeStyle = forward > 0 ? main : ink;
        context.lineWidth = 1.2;
        strokePoints(context, ring);
      } });
    }
    const box = [[0.018, 0.011], [0.018, -0.011], [-0.018, -0.011], [-0.018, 0.011]];
    const top = box.map(([f, r]) => project(world([f, r, -0.007])));
    const center = project(world([0, 0, 0]));
    if (center) {
      parts.push({ depth: center[2], paint: () => {
        context.fillStyle = ghost ? main : ink;
        context.globalAlpha = ghost ? 0.2 : 0.92;
        fillPoints(context, top);
        context.globalAlpha = ghost ? 0.5 : 1;
        const nose = [world([0.018, 0, -0.007]), world([0.05, 0, -0.007])].map(project);
        context.strokeStyle = main;
        context.lineWidth = ghost ? 1 : 2.6;
        strokePoints(context, nose);
      } });
    }
    parts.sort((a, b) => b.depth - a.depth).forEach((part) => part.paint());
    context.globalAlpha = 1;
  };

  const fillPoints = (context, points) => {
    if (points.some((point) => !point)) return;
    context.beginPath();
    points.forEach((point, k) => (k ? context.lineTo(point[0], point[1]) : context.moveTo(point[0], point[1])));
    context.closePath();
    context.fill();
  };

  const drawSpace = () => {
    const { context, width, height } = prepare(canvas);
    const index = indexAt(state.time);
    if (state.follow && primary) {
      const place = positionAt(primary, index);
      if (place) camera.target = place;
    }
    const project = makeProjection(width, height);
    context.lineJoin = context.lineCap = 'round';
    const step = drawGround(context, project);
    const last = data.points - 1;
    for (const actor of [...paths].reverse()) {
      context.strokeStyle = color(variable(actor.role));
      context.setLineDash(actor.role === 'setpoint' ? [6, 5] : []);
      const main = actor === primary;
      context.lineWidth = main ? 2 : 1.6;
      context.globalAlpha = main ? 0.28 : 0.6;
      drawPath(context, project, actor, indexAt(state.from), main ? indexAt(state.to) : Math.min(indexAt(state.to), last));
      context.setLineDash([]);
      if (main) {
        context.globalAlpha = 1;
        context.lineWidth = 2.2;
        drawPath(context, project, actor, Math.min(indexAt(state.from), index), index);
      }
      context.globalAlpha = 1;
    }
    // Large enough to see the attitude, never smaller than it is.
    const scale = Math.max(1, (camera.distance * 0.048) / ARM);
    const target = data.scene.find((actor) => actor.role === 'setpoint');
    const goal = target && positionAt(target, index);
    const mark = goal && project(goal);
    if (mark) {
      context.strokeStyle = color('--setpoint');
      context.lineWidth = 1.6;
      context.beginPath();
      context.arc(mark[0], mark[1], 6, 0, 2 * Math.PI);
      context.stroke();
    }
    const truth = data.scene.find((actor) => actor.role === 'truth');
    if (truth && truth !== primary) drawVehicle(context, project, truth, index, scale, true);
    if (primary) drawVehicle(context, project, primary, index, scale, false);
    context.fillStyle = color('--dim');
    context.font = '11px system-ui, sans-serif';
    context.textAlign = 'right';
    context.textBaseline = 'bottom';
    const enlarged = scale > 1.2 ? ` · vehicle ×${scale < 10 ? scale.toFixed(1) : scale.toFixed(0)}` : '';
    context.fillText(`grid ${Number(step.toPrecision(3))} m${enlarged}`, width - 12, height - 8);
  };

  const turnWithPointer = () => {
    const pointers = new Map();
    let apart = 0;
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      apart = 0;
    });
    canvas.addEventListener('pointermove', (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      if (pointers.size === 1) {
        camera.turn += dx * 0.008;
        camera.tilt = clamp(camera.tilt + dy * 0.008, -0.1, Math.PI / 2);
      } else {
        const [a, b] = [...pointers.values()];
        const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (apart) zoom(apart / now);
        apart = now;
      }
      refresh();
    });
    const drop = (event) => { pointers.delete(event.pointerId); apart = 0; };
    canvas.addEventListener('pointerup', drop);
    canvas.addEventListener('pointercancel', drop);
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.0015));
      refresh();
    }, { passive: false });
    canvas.addEventListener('dblclick', () => {
      Object.assign(camera, HOME, { target: [...middle] });
      refresh();
    });
  };
  const zoom = (factor) => { camera.distance = clamp(camera.distance * factor, 0.25, size * 8); };

  // ---- Time -------------------------------------------------------------------------------------------------

  let scheduled = false;
  let moved = 0;
  /** Draws what changed, once per frame. */
  const refresh = () => {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame((now) => {
      scheduled = false;
      if (state.playing) {
        const passed = Math.min((now - moved) / 1000, 0.1) * state.speed;
        moved = now;
        state.time += passed;
        if (state.time >= end) { state.time = end; state.playing = false; }
      }
      draw();
      if (state.playing) refresh();
    });
  };

  const draw = () => {
    drawSpace();
    for (const area of areas) {
      if (area.visible && area.stale) { area.draw(); area.stale = false; }
      area.update();
    }
    const shown = state.hover ?? state.time;
    for (const { output, line } of readouts) output.textContent = number(valueAt(line.channel, shown), decimals[line.channel]);
    element('slider').value = ((state.time - data.start) / duration) * 1000;
    element('clock').textContent = clock(state.time);
    element('play').textContent = state.playing ? '❚❚' : '▶';
    element('speed').textContent = `${state.speed}×`;
    element('reset').hidden = state.from === data.start && state.to === end;
    drawState();
    element('when').textContent = state.hover === null ? HINT : `at ${clock(state.hover)}`;
    for (const { output, value, unit, digits } of figures) {
      output.firstChild.textContent = number(value(), digits);
      output.lastChild.textContent = ` ${unit}`;
    }
  };

  const drawState = () => {
    const node = element('state');
    const chips = [];
    for (const band of data.bands) {
      const now = band.stretches.find(([from, to]) => state.time >= from && state.time < to);
      if (now) chips.push([band.alert ? band.title : now[2], band.alert]);
    }
    const key = JSON.stringify(chips);
    if (node.dataset.key === key) return;
    node.dataset.key = key;
    node.replaceChildren();
    for (const [text, alert] of chips) make('span', node, alert ? 'alert' : '', text);
  };

  const setTime = (time) => { state.time = clamp(time, data.start, end); refresh(); };
  const setView = (from, to) => {
    [state.from, state.to] = [from, to];
    for (const area of areas) area.stale = true;
    refresh();
  };
  const restyle = () => {
    styles = getComputedStyle(document.documentElement);
    for (const area of areas) area.stale = true;
    refresh();
  };

  // Figures below the space, of the estimate or whoever else is there.
  const figures = [];
  const buildFigures = () => {
    const wanted = [['Attitude', ['Roll', 'Pitch', 'Yaw']], ['Position', ['North', 'East', 'Up']]];
    for (const [group, titles] of wanted) {
      for (const title of titles) {
        const panel = data.panels.find((p) => p.group === group && p.title === title);
        const line = panel && panel.lines.find((l) => l.role !== 'setpoint');
        if (!line) continue;
        const box = make('div', element('readout'));
        make('dt', box, '', title);
        const output = make('dd', box);
        make('span', output);
        make('small', output);
        figures.push({ output, unit: panel.unit, digits: decimals[line.channel], value: () => valueAt(line.channel, state.time) });
      }
    }
    const speed = ['North', 'East', 'Up'].map((title) => data.panels.find((p) => p.group === 'Velocity' && p.title === title));
    if (speed.every(Boolean)) {
      const box = make('div', element('readout'));
      make('dt', box, '', 'Speed');
      const output = make('dd', box);
      make('span', output);
      make('small', output);
      figures.push({ output, unit: 'm/s', digits: 2, value: () => Math.hypot(...speed.map((p) => valueAt(p.lines[0].channel, state.time))) });
    }
  };

  const buildLegend = () => {
    const names = { estimate: 'estimate', truth: 'truth', device: 'on board', setpoint: 'set-point' };
    for (const actor of data.scene) {
      const row = make('div', element('legend'));
      make('i', row, actor.role === 'setpoint' ? 'dashed' : '').style.color = `var(${variable(actor.role)})`;
      row.append(names[actor.role]);
    }
  };

  const togglePlay = () => {
    if (!state.playing && state.time >= end - data.step) state.time = data.start;
    state.playing = !state.playing;
    moved = performance.now();
    refresh();
  };

  element('play').addEventListener('click', togglePlay);
  element('slider').addEventListener('input', (event) => setTime(data.start + (event.target.value / 1000) * duration));
  element('speed').addEventListener('click', () => {
    state.speed = SPEEDS[(SPEEDS.indexOf(state.speed) + 1) % SPEEDS.length];
    refresh();
  });
  element('follow').addEventListener('click', (event) => {
    state.follow = !state.follow;
    event.target.setAttribute('aria-pressed', state.follow);
    if (!state.follow) camera.target = [...middle];
    refresh();
  });
  element('reset').addEventListener('click', () => setView(data.start, end));
  document.addEventListener('keydown', (event) => {
    if (event.target.closest('button, input')) return;
    if (event.key === ' ') { event.preventDefault(); togglePlay(); }
    if (event.key === 'ArrowRight') setTime(state.time + (event.shiftKey ? 1 : 0.1));
    if (event.key === 'ArrowLeft') setTime(state.time - (event.shiftKey ? 1 : 0.1));
  });

  buildPlots();
  buildFigures();
  buildLegend();
  turnWithPointer();
  // Without anything to see in space the plots have the page for themselves.
  document.querySelector('main').classList.toggle('flat', !data.scene.length);
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const area = areas.find((known) => known.node === target);
      if (area) area.visible = isIntersecting;
    }
    refresh();
  }, { rootMargin: '400px' });
  areas.forEach((area) => seen.observe(area.node));
  const sized = new ResizeObserver(restyle);
  [canvas, element('plots')].forEach((node) => sized.observe(node));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', restyle);
  // A third into the flight there is something to see.
  const wanted = Number(new URLSearchParams(location.hash.slice(1)).get('t'));
  setTime(location.hash ? data.start + wanted : data.start + duration * 0.4);
})();
