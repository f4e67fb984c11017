// The data of the page: channels as numbers, the shared state, colours and number formats.

const data = JSON.parse(document.getElementById('data').textContent);
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

/** As many decimals as a channel's largest value deserves, so that a read-out does not jump. */
const decimals = channels.map((values) => {
  let size = 0;
  for (const value of values) if (Math.abs(value) > size) size = Math.abs(value);
  return size >= 1000 ? 0 : size >= 30 ? 1 : size >= 3 ? 2 : 3;
});
const clock = (time) => `${(time - data.start).toFixed(2)} s`;

