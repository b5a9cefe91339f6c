// The traces of the board: position, velocity and force of the last seconds, one strip each, on one canvas.

import { hear, board } from "./live.js";
import { BLUE, FONT, GREEN, NAME, PALE, RED, cleared, number, strip, ticks } from "./canvas.js";

const SHOWN_S = 10, KEPT = 1200, LEFT = 58, RIGHT = 96, FOOT = 24;
const TRACES = [
  { name: "position, mm", column: 1, scale: 1e3, colour: BLUE, least: 1, decimals: 3 },
  { name: "velocity, mm/s", column: 2, scale: 1e3, colour: GREEN, least: 20, decimals: 1 },
  { name: "force, N", column: 4, scale: 1, colour: RED, least: 1, decimals: 2 },
];
export const samples = [];
let fresh = false;

hear("samples", (more) => {
  samples.push(...more);
  if (samples.length > KEPT) samples.splice(0, samples.length - KEPT);
  fresh = true;
});

// Whether samples came since the last call.
export function takeFresh() {
  const was = fresh;
  fresh = false;
  return was;
}

export function latest() {
  return samples[samples.length - 1];
}

// What the drawing shows last, in words.
export function sayTraces(canvas) {
  const values = TRACES.map(({ name, column, scale, decimals }) => {
    const [what, unit] = name.split(", ");
    return samples.length ? `${what} ${number(latest()[column] * scale, decimals)} ${unit}` : `no ${what} yet`;
  });
  canvas.setAttribute("aria-label", `What the board shows: ${values.join(", ")}; and the last ${SHOWN_S} s of each`);
}

function range(trace, first) {
  let low = Infinity, high = -Infinity;
  for (let k = first; k < samples.length; k++) {
    const value = samples[k][trace.column] * trace.scale;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) [low, high] = [0, 0];
  const spare = Math.max((high - low) * 0.08, (trace.least - (high - low)) / 2, 0);
  return [low - spare, high + spare];
}

export function drawTraces(canvas) {
  const { context, width, height } = cleared(canvas);
  const box = { left: LEFT, width: width - LEFT - RIGHT, height: (height - FOOT) / 3 - NAME, top: NAME };
  const now = samples.length ? latest()[0] : 0;
  let first = samples.length;
  while (first > 0 && samples[first - 1][0] > now - SHOWN_S) first--;
  const across = (time) => LEFT + box.width * (1 - (now - time) / SHOWN_S);
  for (const trace of TRACES) {
    const [low, high] = range(trace, first);
    const at = strip(context, box, low, high, trace.name);
    context.strokeStyle = trace.colour;
    context.lineWidth = 1.6;
    context.beginPath();
    for (let k = first; k < samples.length; k++) {
      context.lineTo(across(samples[k][0]), at(samples[k][trace.column] * trace.scale));
    }
    context.stroke();
    if (samples.length) {
      const value = latest()[trace.column] * trace.scale;
      context.fillStyle = board.told && board.told.state === "SILENT" ? PALE : trace.colour;
      context.font = "600 17px Roboto, sans-serif";
      context.fillText(number(value, trace.decimals), LEFT + box.width + 8, at(value));
    }
    box.top += box.height + NAME;
  }
  context.textAlign = "center";
  context.fillStyle = PALE;
  context.font = FONT;
  for (const value of ticks(-SHOWN_S, 0, Math.min(5, box.width / 60)).values) context.fillText(`${number(value, 0)} s`, across(now + value), height - 9);
}
