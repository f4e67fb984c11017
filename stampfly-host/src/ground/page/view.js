// All vehicles in space with their trails, above a grid; a click on the ground asks the chosen one to go there.

const canvas = element('space');
/** A camera that sees where all vehicles begin. */
const home = () => {
  const places = scene().map((vehicle) => vehicle.card.place);
  const low = [0, 1].map((axis) => Math.min(0, ...places.map((place) => place[axis])));
  const high = [0, 1].map((axis) => Math.max(0, ...places.map((place) => place[axis])));
  const wide = Math.hypot(high[0] - low[0], high[1] - low[1]);
  return { turn: -2.25, tilt: 0.5, distance: 3.4 + wide * 0.9, target: [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, -0.25] };
};
const camera = { turn: -2.25, tilt: 0.5, distance: 3.4, target: [0, 0, -0.25] };
const view = { follow: false };
const TRAIL = 60; // Seconds of the past that are drawn.

const colorOf = (vehicle) => (vehicle.isLog || scene().length === 1 ? '--estimate' : `--c${vehicle.number % 8}`);
const shifted = ([n, e, d], vehicle) => [n + vehicle.card.place[0], e + vehicle.card.place[1], d];

const drawGround = (context, project) => {
  const step = tickStep(camera.distance * 1.2, 10);
  const reach = step * 16;
  const center = [0, 1].map((axis) => Math.round(camera.target[axis] / step) * step);
  for (let k = -16; k <= 16; k++) {
    for (const axis of [0, 1]) {
      const a = [0, 0, 0], b = [0, 0, 0];
      a[axis] = b[axis] = center[axis] + k * step;
      a[1 - axis] = center[1 - axis] - reach;
      b[1 - axis] = center[1 - axis] + reach;
      const origin = Math.abs(a[axis]) < step * 0.01;
      context.strokeStyle = color(origin ? '--dim' : '--line');
      context.globalAlpha = origin ? 0.6 : 0.75;
      context.lineWidth = 1;
      strokeSegment(context, project, a, b);
    }
  }
  context.globalAlpha = 1;
  context.font = '12px system-ui, sans-serif';
  context.fillStyle = color('--dim');
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  for (const [name, place] of [['N', [center[0] + step * 4.3, 0, 0]], ['E', [0, center[1] + step * 4.3, 0]]]) {
    const at = project(place);
    if (at) context.fillText(name, at[0], at[1]);
  }
  return step;
};

/** A long line near the camera goes behind it: it is drawn in parts. */
const strokeSegment = (context, project, a, b) => {
  const points = [];
  for (let k = 0; k <= 16; k++) points.push(project(a.map((value, axis) => value + ((b[axis] - value) * k) / 16)));
  strokePoints(context, points);
};

const drawTrail = (context, project, vehicle, name, time) => {
  const columns = [0, 1, 2].map((axis) => vehicle.columns.get(`${name}.${axis}`)?.values);
  if (columns.some((values) => !values)) return;
  const to = framesUntil(vehicle, time), from = framesUntil(vehicle, time - TRAIL);
  const stride = Math.max(1, Math.floor((to - from) / 800));
  const points = [];
  let before = null;
  // Counted from the beginning, so that a trail does not tremble while it grows.
  for (let index = from - (from % stride); index < to; index += stride) {
    const point = columns.map((values) => values[index]);
    // An estimate that begins anew is no way that was flown.
    if (before && Math.hypot(...point.map((value, axis) => value - before[axis])) > 0.3 * stride) points.push(null);
    before = point;
    points.push(point.every(Number.isFinite) ? project(shifted(point, vehicle)) : null);
  }
  strokePoints(context, points);
};

const drawSpace = () => {
  const { context, width, height } = prepare(canvas);
  const chosen = selected();
  const place = chosen && poseOf(chosen, observersOf(chosen.card).main)?.place;
  if (view.follow && place) {
    const wanted = shifted(place, chosen);
    camera.target = camera.target.map((value, axis) => value + (wanted[axis] - value) * 0.15);
  }
  const project = makeProjection(camera, width, height);
  context.lineJoin = context.lineCap = 'round';
  const step = drawGround(context, project);
  for (const vehicle of scene()) {
    const { main, truth } = observersOf(vehicle.card);
    const isChosen = vehicle === chosen, body = vehicle.card.page.body;
    const scale = Math.max(1, (camera.distance * 0.04) / body.reach);
    if (truth && isChosen) {
      context.strokeStyle = color('--truth');
      context.lineWidth = 1.5;
      context.globalAlpha = 0.55;
      drawTrail(context, project, vehicle, 'truth', vehicle.clock);
    }
    context.strokeStyle = color(colorOf(vehicle));
    context.lineWidth = isChosen ? 2.2 : 1.4;
    context.globalAlpha = isChosen ? 1 : 0.7;
    drawTrail(context, project, vehicle, 'main', vehicle.clock);
    context.globalAlpha = 1;
    if (vehicle.goal) drawGoal(context, project, vehicle, colorOf(vehicle));
    for (const [observer, ghost] of [[truth, true], [main, false]]) {
      if (ghost && !isChosen) continue;
      const pose = poseOf(vehicle, observer);
      if (!pose) continue;
      const paint = color(ghost ? '--truth' : colorOf(vehicle));
      drawBody(context, project, { ...pose, place: shifted(pose.place, vehicle), body, scale, main: paint, ghost, ground: 0 });
    }
    const pose = scene().length > 1 && poseOf(vehicle, main);
    const above = pose && project(shifted([pose.place[0], pose.place[1], pose.place[2] - body.reach * scale * 1.5], vehicle));
    if (above) {
      context.fillStyle = color(isChosen ? '--ink' : '--dim');
      context.font = `${isChosen ? '600 ' : ''}12px system-ui, sans-serif`;
      context.textAlign = 'center';
      context.textBaseline = 'bottom';
      context.fillText(vehicle.card.name, above[0], above[1]);
    }
  }
  context.fillStyle = color('--dim');
  context.font = '11px system-ui, sans-serif';
  context.textAlign = 'right';
  context.textBaseline = 'bottom';
  context.fillText(`grid ${Number(step.toPrecision(3))} m`, width - 12, height - 8);
};

const drawGoal = (context, project, vehicle, name) => {
  const { north, east, up } = vehicle.goal;
  const [foot, top] = [0, -up].map((down) => project(shifted([north, east, down], vehicle)));
  if (!foot || !top) return;
  context.strokeStyle = color('--setpoint');
  context.lineWidth = 1.4;
  context.setLineDash([3, 4]);
  strokePoints(context, [foot, top]);
  context.setLineDash([]);
  for (const [point, radius] of [[foot, 3], [top, 7]]) {
    context.beginPath();
    context.arc(point[0], point[1], radius, 0, 2 * Math.PI);
    context.stroke();
  }
};

/** The place on the ground under a pixel; null above the horizon. The inverse of makeProjection. */
const groundAt = (x, y) => {
  const { clientWidth: width, clientHeight: height } = canvas;
  const [st, ct, si, ci] = [Math.sin(camera.turn), Math.cos(camera.turn), Math.sin(camera.tilt), Math.cos(camera.tilt)];
  const focal = Math.min(width, height * 1.25) * 1.05;
  const a = (x - width / 2) / focal, b = (height * 0.52 - y) / focal, u = camera.target[2];
  if (Math.abs(si) < 0.02) return null;
  const depth = (camera.distance - u / si) / (1 - (b * ci) / si);
  if (!(depth > 0) || depth > 60 * camera.distance) return null;
  const ahead = (b * depth - u * ci) / si, right = a * depth;
  return [camera.target[0] + ahead * ct - right * st, camera.target[1] + ahead * st + right * ct];
};

const resetCamera = () => Object.assign(camera, home());
turnWithPointer(canvas, camera, {
  farthest: 60, lowest: 0.06, reset: resetCamera, changed: () => {},
  clicked: (event) => {
    const box = canvas.getBoundingClientRect();
    const place = groundAt(event.clientX - box.left, event.clientY - box.top);
    if (place) goByClick(place);
  },
});
canvas.addEventListener('keydown', (event) => {
  const turns = { ArrowLeft: -0.1, ArrowRight: 0.1 }, tilts = { ArrowUp: 0.06, ArrowDown: -0.06 };
  if (sticks.isKeyboard) return;
  if (turns[event.key]) camera.turn += turns[event.key];
  else if (tilts[event.key]) camera.tilt = clamp(camera.tilt + tilts[event.key], 0.06, Math.PI / 2);
  else if (event.key === '+' || event.key === '-') camera.distance = clamp(camera.distance * (event.key === '+' ? 0.9 : 1.1), 0.25, 60);
  else return;
  event.preventDefault();
});

