// Calibration: what to do with the vehicle, drawn; how far it is; and what takes what was found.

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

/** Faces in the order of the report's bits, and how a simulated vehicle is held so. */
const FACES = [['-x', 'nose-down'], ['+x', 'tail-down'], ['-y', 'right-down'], ['+y', 'left-down'], ['-z', 'level'], ['+z', 'upside-down']];
const faces = FACES.map(([side, hold]) => [hold, SIDES[side]]);

/** Kind, its name in the report, title, what to do, pictures: how a simulated vehicle is brought there, and the shape. */
const KINDS = [
  ['temperature', 'Temperature', 'Temperature', 'Put it down cold and leave it alone while it warms up, by eight degrees. First of all.', [['warm 12 60', SIDES['-z'], 'Lying still']]],
  ['six_positions', 'SixPositions', 'Accelerometer, six positions', 'Lay it on each of its sides, in any order, two seconds each, and on one of them again. The coloured line is its nose.',
    faces.map(([hold, shape]) => [`hold ${hold}`, shape, shape.title])],
  ['level', 'Level', 'Level', 'Stand it on a table that a spirit level calls level, and leave it alone. After the six positions.', [['down', SIDES['-z'], 'Standing level']]],
  ['compass', 'Magnetometer', 'Compass', 'Away from iron, turn it slowly through every attitude: the nose all around, and every side down.', [['turn', SIDES['+y'], 'Turning']]],
];

const calibration = { vehicle: null, rows: [], told: '' };

/** What was taken is in the parameters, which are read again. */
const readCalibration = async (vehicle) => {
  for (const parameter of vehicle.card.parameters.filter(({ name }) => name.startsWith('calibration.'))) {
    const reply = await ask(vehicle.number, { do: 'param_get', name: parameter.name });
    if (!reply.ok) continue;
    parameter.value = reply.value;
    vehicle.rows?.find((row) => row.parameter === parameter)?.show();
  }
};

const buildCalibration = (vehicle) => {
  const root = element('calibrations');
  root.replaceChildren();
  [calibration.vehicle, calibration.rows, calibration.told] = [vehicle, [], ''];
  const offer = (kind) => (vehicle.isLog ? undefined : vehicle.card.calibrations.find((calibration) => calibration.kind === kind));
  const isSimulated = !vehicle.isLog && vehicle.card.offers.includes('fault');
  const sorted = [...KINDS.filter(([kind]) => offer(kind)), ...KINDS.filter(([kind]) => !offer(kind))];
  for (const [kind, name, title, text, pictures] of sorted) {
    const offered = offer(kind);
    const section = make('section', root, offered ? '' : 'absent');
    section.dataset.kind = kind;
    make('h3', section, '', title);
    make('p', section, 'dim', offered ? text : `${text} `);
    if (!offered) make('em', section.lastChild, '', vehicle.isLog ? 'A recorded flight.' : 'Not offered by this vehicle.');
    const row = make('div', section, 'steps');
    const steps = pictures.map(([hold, shape, caption]) => {
      const button = make('button', row, 'step');
      button.type = 'button';
      button.disabled = !offered || !isSimulated;
      if (!button.disabled) button.title = 'In the simulation, a click does this.';
      picture(button, shape, caption);
      make('span', button, '', caption);
      button.addEventListener('click', () => command({ do: 'console', line: `world ${hold}` }, caption.toLowerCase()));
      return button;
    });
    if (!offered) continue;
    const buttons = make('p', section, 'buttons');
    const click = (label, line) => {
      const button = make('button', buttons, '', label);
      button.type = 'button';
      button.addEventListener('click', async () => {
        await command({ do: 'console', line }, `${title.toLowerCase()}, ${label.toLowerCase()}`);
        calibration.told = '';
        if (line === 'calibrate accept') readCalibration(vehicle);
      });
      return button;
    };
    const begin = click('Begin', offered.line), cancel = click('Cancel', 'calibrate cancel'), accept = click('Take and keep', 'calibrate accept');
    const bar = make('progress', buttons);
    bar.max = 1;
    bar.setAttribute('aria-label', `${title}, progress`);
    const said = make('p', section, 'said');
    said.setAttribute('role', 'status');
    calibration.rows.push({ name, steps, begin, cancel, accept, bar, said });
  }
};

/** Ten times a second: what the vehicle reports of it. Its own words are asked for when it has changed. */
const writeCalibration = (vehicle) => {
  if (calibration.vehicle !== vehicle || vehicle.isLog || element('calibrations').closest('[hidden]')) return;
  const of = (name) => field(vehicle, 'calibration_report', name);
  const [kind, stage] = ['kind', 'stage'].map((name) => named(vehicle, 'calibration_report', name));
  const [held] = of('faces') ?? [0], [progress] = of('progress') ?? [0];
  for (const row of calibration.rows) {
    const isThis = row.name === kind, isRunning = isThis && stage === 'Running';
    row.begin.disabled = isRunning || isArmed(vehicle);
    row.cancel.hidden = !isRunning;
    row.accept.hidden = !(isThis && stage === 'Done');
    row.bar.hidden = !isThis;
    row.bar.value = isThis ? progress : 0;
    row.steps.forEach((step, place) => {
      const isDone = isThis && (row.steps.length > 1 ? (held & (1 << place)) !== 0 : stage === 'Done');
      step.classList.toggle('done', isDone);
    });
    if (!isThis) setText(row.said, '');
  }
  const known = vehicle.topics.get('calibration_report');
  const news = `${known?.values?.slice(0, 5).map((value) => value.toFixed(1))}`;
  const row = calibration.rows.find(({ name }) => name === kind);
  if (!row || news === calibration.told) return;
  calibration.told = news;
  ask(vehicle.number, { do: 'console', line: 'calibrate status' }).then((reply) => { if (reply.ok) setText(row.said, reply.text); });
};
