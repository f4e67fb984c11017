// Time goes by: drawing once per frame, the player, the read-outs; then everything is put together.

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
turnWithPointer(canvas, camera, {
  farthest: size * 8,
  reset: () => Object.assign(camera, HOME, { target: [...middle] }),
  changed: refresh,
});
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

