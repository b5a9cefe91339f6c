// What the drawings share: a canvas in the pixels of the screen, colours, and round numbers for axes.

const LIGHT = {
  ...{ ink: "#1d2733", pale: "#5d6b7a", grid: "#e3e8ee", wall: "#fbe3d3", hatch: "#eab48f" },
  ...{ blue: "#0072b2", green: "#00795a", red: "#c25400", violet: "#8a3f8f", grey: "#444444" },
};
const DARK = {
  ...{ ink: "#e6ebf0", pale: "#a3afbc", grid: "#333d48", wall: "#4a2f1c", hatch: "#8a5530" },
  ...{ blue: "#5cb3ec", green: "#3cc79a", red: "#f5924a", violet: "#d79ddb", grey: "#c4c4c4" },
};
const scheme = window.matchMedia("(prefers-color-scheme: dark)");
export const colours = {}; // those of the browser's scheme, light or dark
function choose() {
  Object.assign(colours, scheme.matches ? DARK : LIGHT);
}
scheme.addEventListener("change", choose);
choose();
export const FONT = "12px Roboto, sans-serif", SMALL = "11px Roboto, sans-serif";

// Returns the context of a canvas, cleared, with the unit of one pixel of the page; and its size.
export function cleared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = FONT;
  context.textBaseline = "middle";
  return { context, width, height };
}

// Returns about `count` round numbers from `low` to `high`, and how many decimals they need.
export function ticks(low, high, count) {
  if (count <= 0) return { values: [], decimals: 0 };
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= raw * 0.999);
  const values = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) values.push(k * step);
  return { values, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

export function number(value, decimals) {
  return value.toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "\u2212");
}

// The height above a strip in which its name stands.
export const NAME = 20;

// Draws the frame of a strip, with its numbers and its name above it; returns the height at which a value is drawn.
export function strip(context, box, low, high, name) {
  const { left, top, width, height } = box;
  const at = (value) => top + height * (1 - (value - low) / (high - low));
  const marks = ticks(low, high, Math.max(2, Math.round(height / 22)));
  context.textAlign = "right";
  for (const value of marks.values) {
    context.fillStyle = colours.grid;
    context.fillRect(left, Math.round(at(value)), width, 1);
    context.fillStyle = colours.pale;
    context.font = SMALL;
    context.fillText(number(value, marks.decimals), left - 6, at(value));
  }
  context.textAlign = "left";
  context.fillStyle = colours.ink;
  context.font = FONT;
  context.fillText(name, left, top - 9);
  return at;
}
