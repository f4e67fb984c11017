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

const attitudeAt = (actor, index) => {
  const q = actor.attitude ? actor.attitude.map((channel) => channels[channel][index]) : [1, 0, 0, 0];
  return q.some(Number.isNaN) ? null : q;
};

const body = data.body; // Metres, forward, right, down.

const drawVehicle = (context, project, actor, index, scale, ghost) => {
  const place = positionAt(actor, index), attitude = attitudeAt(actor, index);
  if (!place || !attitude) return;
  drawBody(context, project, { place, attitude, body, scale, main: color(variable(actor.role)), ghost, ground: bounds.ground });
};

const drawSpace = () => {
  const { context, width, height } = prepare(canvas);
  const index = indexAt(state.time);
  if (state.follow && primary) {
    const place = positionAt(primary, index);
    if (place) camera.target = place;
  }
  const project = makeProjection(camera, width, height);
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

