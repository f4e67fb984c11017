// The flight in space: ground, paths and the vehicle with its attitude, seen by a camera that turns and zooms.

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
// A square flown round is seen from a corner: what has to fit is its diagonal.
const wide = Math.hypot(bounds.high[0] - bounds.low[0], bounds.high[1] - bounds.low[1]);
const size = Math.max(wide, (bounds.ground - bounds.low[2]) * 1.2, 0.6);
const middle = [0, 1].map((axis) => (bounds.low[axis] + bounds.high[axis]) / 2).concat((bounds.low[2] + bounds.ground) / 2);
const HOME = { turn: -2.25, tilt: 0.42, distance: size * 1.35 };
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

const body = data.body; // Metres, forward, right, down.

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
      shadow.push(project([foot[0] + 1.2 * body.reach * scale * Math.cos(angle), foot[1] + 1.2 * body.reach * scale * Math.sin(angle), foot[2]]));
    }
    fillPoints(context, shadow);
    context.globalAlpha = 1;
  }

  const parts = [];
  for (const [forward, right, down] of body.rings) {
    const ring = [];
    for (let k = 0; k <= 28; k++) {
      const angle = (k / 28) * 2 * Math.PI;
      ring.push(project(world([forward + body.radius * Math.cos(angle), right + body.radius * Math.sin(angle), down])));
    }
    const hub = project(world([forward, right, down]));
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
  const top = body.outline.map(([f, r]) => project(world([f, r, body.down])));
  const center = project(world([0, 0, 0]));
  if (center) {
    parts.push({ depth: center[2], paint: () => {
      context.fillStyle = ghost ? main : ink;
      context.globalAlpha = ghost ? 0.2 : 0.92;
      fillPoints(context, top);
      context.globalAlpha = ghost ? 0.5 : 1;
      const nose = [world([0, 0, body.down]), world([body.nose, 0, body.down])].map(project);
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
  const scale = Math.max(1, (camera.distance * 0.048) / body.reach);
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

