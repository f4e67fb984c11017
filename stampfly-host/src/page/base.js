// What the scripts of all pages need: elements, numbers, colours.

const element = (id) => document.getElementById(id);
const make = (tag, parent, className = '', text = '') => {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text) node.textContent = text;
  if (parent) parent.append(node);
  return node;
};
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

let styles = getComputedStyle(document.documentElement);
const color = (name) => styles.getPropertyValue(name).trim();

const ROLES = ['estimate', 'truth', 'setpoint', 'device', 'range'];
const variable = (role) => (ROLES.includes(role) ? `--${role}` : `--c${Number(role) % 8}`);

const fixed = (value, digits) => value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1').replace('-', '−');
const number = (value, digits) => (Number.isFinite(value) ? fixed(value, digits) : '–');

