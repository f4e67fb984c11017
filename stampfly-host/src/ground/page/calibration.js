// Calibration: what to do with the vehicle, drawn, and the button that begins each step.

const SVG = 'http://www.w3.org/2000/svg';
const draw = (parent, kind, attributes) => {
  const node = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  parent.append(node);
  return node;
};

/** Axes of the body (forward, right, down) as they point in the room when this side is up: right, away, up. */
const SIDES = {
  '-z': { title: 'upright', axes: { f: [0, 1, 0], r: [1, 0, 0], d: [0, 0, -1] } },
  '+z': { title: 'upside down', axes: { f: [0, 1, 0], r: [-1, 0, 0], d: [0, 0, 1] } },
  '+x': { title: 'nose up', axes: { f: [0, 0, 1], r: [1, 0, 0], d: [0, 1, 0] } },
  '-x': { title: 'nose down', axes: { f: [0, 0, -1], r: [1, 0, 0], d: [0, -1, 0] } },
  '+y': { title: 'right side up', axes: { f: [0, 1, 0], r: [0, 0, 1], d: [1, 0, 0] } },
  '-y': { title: 'left side up', axes: { f: [0, 1, 0], r: [0, 0, -1], d: [-1, 0, 0] } },
};

/** A picture of the vehicle lying on a table with one side up. */
const picture = (parent, { axes }, title) => {
  const svg = draw(parent, 'svg', { viewBox: '-60 -52 120 92', class: 'picture', role: 'img', 'aria-label': title });
  const [turn, tilt] = [0.5, 0.42];
  const flat = ([x, y, z]) => {
    const [right, away] = [x * Math.cos(turn) - y * Math.sin(turn), x * Math.sin(turn) + y * Math.cos(turn)];
    return [right, -(away * Math.sin(tilt) + z * Math.cos(tilt)), away * Math.cos(tilt) - z * Math.sin(tilt)];
  };
  const world = ([f, r, d]) => [0, 1, 2].map((axis) => axes.f[axis] * f + axes.r[axis] * r + axes.d[axis] * d);
  const path = (points) => `${points.map((point, k) => `${k ? 'L' : 'M'}${point[0].toFixed(1)} ${point[1].toFixed(1)}`).join('')}`;
  const table = [[-46, -40, -27], [46, -40, -27], [46, 40, -27], [-46, 40, -27]].map(flat);
  draw(svg, 'path', { d: `${path(table)}Z`, class: 'table' });
  const parts = [];
  for (const [f, r] of [[20, 20], [-20, 20], [-20, -20], [20, -20]]) {
    const ring = [];
    for (let k = 0; k <= 24; k++) ring.push(flat(world([f + 13 * Math.cos((k * Math.PI) / 12), r + 13 * Math.sin((k * Math.PI) / 12), -5])));
    parts.push({ depth: flat(world([f, r, -5]))[2], d: path(ring), arm: path([flat([0, 0, 0]), flat(world([f, r, -5]))]), front: f > 0 });
  }
  const plate = [[12, 7, -4], [12, -7, -4], [-12, -7, -4], [-12, 7, -4]].map((point) => flat(world(point)));
  const nose = path([flat(world([0, 0, -4])), flat(world([34, 0, -4]))]);
  parts.sort((a, b) => b.depth - a.depth).forEach((part) => {
    draw(svg, 'path', { d: part.arm, class: 'arm' });
    draw(svg, 'path', { d: part.d, class: part.front ? 'rotor front' : 'rotor' });
  });
  draw(svg, 'path', { d: `${path(plate)}Z`, class: 'plate' });
  draw(svg, 'path', { d: nose, class: 'nose' });
  return svg;
};

const KINDS = [
  ['gyro', 'Gyro', 'Put it down and do not touch it.', [['', SIDES['-z'], 'Lying still']]],
  ['level', 'Level', 'Stand it on a table that a spirit level calls level.', [['', SIDES['-z'], 'Standing level']]],
  ['six_positions', 'Accelerometer, six positions', 'Hold it still on each of its sides, in any order. The coloured line is its nose.',
    Object.entries(SIDES).map(([side, shape]) => [side, shape, shape.title])],
  ['compass', 'Compass', 'Turn it slowly through every attitude, away from iron.', [['', SIDES['+y'], 'Turning']]],
];

const buildCalibration = (vehicle) => {
  const root = element('calibrations');
  root.replaceChildren();
  const offer = (kind) => (vehicle.isLog ? undefined : vehicle.card.calibrations.find((calibration) => calibration.kind === kind));
  const sorted = [...KINDS.filter(([kind]) => offer(kind)), ...KINDS.filter(([kind]) => !offer(kind))];
  for (const [kind, title, text, steps] of sorted) {
    const offered = offer(kind);
    const section = make('section', root, offered ? '' : 'absent');
    make('h3', section, '', title);
    make('p', section, 'dim', offered ? text : `${text} `);
    if (!offered) make('em', section.lastChild, '', vehicle.isLog ? 'A recorded flight.' : 'Not offered by this vehicle.');
    const row = make('div', section, 'steps');
    for (const [side, shape, name] of steps) {
      const button = make('button', row, 'step');
      button.type = 'button';
      button.disabled = !offered;
      picture(button, shape, name);
      const caption = make('span', button, '', name);
      button.addEventListener('click', async () => {
        caption.textContent = `${name} …`;
        const reply = await command({ do: 'console', line: offered.line.replaceAll('{side}', side) }, `${title.toLowerCase()}, ${name}`);
        caption.textContent = `${name} ${reply.ok ? '✓' : '✗'}`;
      });
    }
  }
};

