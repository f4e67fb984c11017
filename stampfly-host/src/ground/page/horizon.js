// The attitude as a horizon, with heading and tilt in numbers.

const drawHorizon = (node, attitude) => {
  const { context, width, height } = prepare(node);
  const [cx, cy] = [width / 2, height / 2], radius = Math.min(cx, cy) - 2;
  context.save();
  context.beginPath();
  context.arc(cx, cy, radius, 0, 2 * Math.PI);
  context.clip();
  const [roll, pitch, yaw] = attitude ? rollPitchYaw(attitude) : [0, 0, NaN];
  const perRadian = radius * 1.6;
  context.translate(cx, cy);
  context.rotate(-roll);
  context.translate(0, pitch * perRadian);
  context.fillStyle = color('--sky');
  context.fillRect(-4 * radius, -8 * radius, 8 * radius, 8 * radius);
  context.fillStyle = color('--earth');
  context.fillRect(-4 * radius, 0, 8 * radius, 8 * radius);
  context.strokeStyle = '#ffffffcc';
  context.lineWidth = 1.5;
  strokePoints(context, [[-4 * radius, 0], [4 * radius, 0]]);
  context.lineWidth = 1;
  for (const degrees of [-60, -45, -30, -15, 15, 30, 45, 60]) {
    const y = (-degrees / DEGREES) * perRadian, half = degrees % 30 ? radius * 0.14 : radius * 0.26;
    strokePoints(context, [[-half, y], [half, y]]);
  }
  context.restore();
  context.strokeStyle = color('--setpoint');
  context.lineWidth = 3;
  strokePoints(context, [[cx - radius * 0.5, cy], [cx - radius * 0.18, cy], [cx, cy + radius * 0.1], [cx + radius * 0.18, cy], [cx + radius * 0.5, cy]]);
  context.strokeStyle = color('--line');
  context.lineWidth = 2;
  context.beginPath();
  context.arc(cx, cy, radius, 0, 2 * Math.PI);
  context.stroke();
  // North on the rim.
  if (Number.isFinite(yaw)) {
    const [x, y] = [cx + Math.sin(-yaw) * radius, cy - Math.cos(yaw) * radius];
    context.fillStyle = color('--bad');
    context.beginPath();
    context.arc(x, y, 4, 0, 2 * Math.PI);
    context.fill();
  }
};

