// A scene in space: what a camera sees, a vehicle with its attitude, and a camera that turns and zooms.

/** Camera coordinates of a point: right, up, depth. */
const makeProjection = (camera, width, height) => {
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

/** Body FRD to world with the quaternion w, x, y, z. */
const rotate = ([w, x, y, z], [a, b, c]) => {
  const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
};

/**
 * A vehicle: `place` NED and `attitude` to world, its `body` in metres forward, right, down, enlarged by `scale`, in the colour
 * `main`. A ghost is only hinted at.
 */
const drawBody = (context, project, { place, attitude, body, scale, main, ghost, ground }) => {
  const world = (point) => {
    const turned = rotate(attitude, point.map((value) => value * scale));
    return turned.map((value, axis) => value + place[axis]);
  };
  const ink = color('--ink');
  context.globalAlpha = ghost ? 0.5 : 1;

  if (!ghost) {
    // A plumb line and a shadow tell where in space the vehicle is.
    const foot = [place[0], place[1], ground];
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

/** Lets pointers turn and zoom a camera; `reset` is called on a double click, `changed` after each change, `clicked` with a place that was pressed without a move. */
const turnWithPointer = (canvas, camera, { farthest, lowest = -0.1, reset, changed, clicked = () => {} }) => {
  const zoom = (factor) => { camera.distance = clamp(camera.distance * factor, 0.25, farthest); };
  const pointers = new Map();
  let apart = 0, moved = 0;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    apart = moved = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    moved += Math.hypot(dx, dy);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 1) {
      camera.turn += dx * 0.008;
      camera.tilt = clamp(camera.tilt + dy * 0.008, lowest, Math.PI / 2);
    } else {
      const [a, b] = [...pointers.values()];
      const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (apart) zoom(apart / now);
      apart = now;
    }
    changed();
  });
  const drop = (event) => { pointers.delete(event.pointerId); apart = 0; };
  canvas.addEventListener('pointerup', (event) => {
    const alone = pointers.size === 1 && moved < 4 && event.button === 0;
    drop(event);
    if (alone) clicked(event);
  });
  canvas.addEventListener('pointercancel', drop);
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.0015));
    changed();
  }, { passive: false });
  canvas.addEventListener('dblclick', () => {
    reset();
    changed();
  });
};

