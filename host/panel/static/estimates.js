// Two estimators of the same counts, side by side, at every sample; and the force of one of them as sound.

import { hear } from "./live.js";
import { NAME, cleared, colours, number, strip } from "./canvas.js";

const SHOWN_S = 0.5, LEFT = 58, HEAD = 18, MIDDLE = 66, RIPPLE_S = 5e-3;
const ROWS = [
  { name: "velocity, mm/s", unit: "mm/s", scale: 1e3, least: 4, decimals: 2 },
  { name: "force of the wall, N", unit: "N", scale: 1, least: 0.2, decimals: 3 },
];
const COLOURS = ["red", "grey"], NARROW = 480;
let rings = null, head = 0, filled = 0, rate = 0, ripples = [];

hear("records", (record) => {
  if (!rings) return;
  const count = record.length / 4, size = rings[0].length;
  for (let row = 0; row < 4; row++) {
    for (let k = 0; k < count; k++) rings[row][(head + k) % size] = record[row * count + k];
  }
  head = (head + count) % size;
  filled = Math.min(filled + count, size);
  play(record, count);
});

export function begin(canvas) {
  rate = Number(canvas.dataset.rate);
  rings = [0, 1, 2, 3].map(() => new Float32Array(Math.round(rate * SHOWN_S)));
}

// Returns the least and the largest value of a row in every column of pixels, and its ripple: RMS within RIPPLE_S.
function columns(row, count) {
  const ring = rings[row], size = ring.length, per = size / count;
  const low = new Float32Array(count).fill(Infinity), high = new Float32Array(count).fill(-Infinity);
  const block = Math.max(2, Math.round(rate * RIPPLE_S));
  // Of a block, what a straight line through it leaves.
  const spread = (block * (block * block - 1)) / 12;
  let sum = 0, squares = 0, slope = 0, within = 0, ripple = 0, blocks = 0;
  for (let k = size - filled; k < size; k++) {
    const value = ring[(head + k) % size], column = Math.floor(k / per);
    if (value < low[column]) low[column] = value;
    if (value > high[column]) high[column] = value;
    sum += value;
    squares += value * value;
    slope += value * (within - (block - 1) / 2);
    if (++within === block) {
      ripple += Math.max(0, squares - sum ** 2 / block - slope ** 2 / spread) / block;
      sum = squares = slope = within = 0;
      blocks++;
    }
  }
  return { low, high, ripple: blocks ? Math.sqrt(ripple / blocks) : 0 };
}

export function drawEstimates(canvas) {
  const { context, width, height } = cleared(canvas);
  const names = [canvas.dataset.own, "plain difference"];
  // Where there is no room beside each other, one estimator is below the other.
  const narrow = width < NARROW, lanes = narrow ? 2 : 1;
  const across = Math.floor(narrow ? width - LEFT - 8 : (width - LEFT - MIDDLE) / 2);
  const part = height / lanes, tall = (part - HEAD - 6) / 2 - NAME;
  if (across < 1) return;
  ripples = [];
  ROWS.forEach((kind, line) => {
    const both = [0, 1].map((lane) => columns(2 * line + lane, across));
    let low = Infinity, high = -Infinity;
    for (const each of both) {
      for (let k = 0; k < across; k++) {
        if (each.low[k] < low) low = each.low[k];
        if (each.high[k] > high) high = each.high[k];
      }
    }
    if (low > high) [low, high] = [0, 0];
    const spare = Math.max((high - low) * 0.12, (kind.least / kind.scale - (high - low)) / 2);
    [low, high] = [(low - spare) * kind.scale, (high + spare) * kind.scale];
    both.forEach((each, lane) => {
      const left = lane && !narrow ? LEFT + across + MIDDLE : LEFT, begin = narrow ? lane * part : 0;
      const top = begin + HEAD + NAME + line * (tall + NAME);
      const at = strip(context, { left, top, width: across, height: tall }, low, high, kind.name);
      context.fillStyle = colours[COLOURS[lane]];
      for (let k = 0; k < across; k++) {
        if (each.low[k] > each.high[k]) continue;
        const from = at(each.high[k] * kind.scale);
        context.fillRect(left + k, from, 1.4, Math.max(1.4, at(each.low[k] * kind.scale) - from));
      }
      context.textAlign = "right";
      const ripple = `ripple ${number(each.ripple * kind.scale, kind.decimals)} ${kind.unit}`;
      context.fillText(ripple, left + across, top - 9);
      ripples.push(`${names[lane]}, ${kind.name.split(",")[0]}: ${ripple}`);
      if (line === 0) {
        context.textAlign = "left";
        context.font = "600 14px Roboto, sans-serif";
        context.fillText(names[lane], left, begin + 8);
        context.textAlign = "right";
        context.font = "11px Roboto, sans-serif";
        context.fillStyle = colours.pale;
        context.fillText(`the last ${SHOWN_S} s of the board`, left + across, begin + 8);
      }
    });
  });
}

// What the drawing shows, in words.
export function sayEstimates(canvas) {
  canvas.setAttribute("aria-label", `Two estimators of the last ${SHOWN_S} s: ${ripples.join("; ")}`);
}

// ---- sound ----------------------------------------------------------------------------------------------------------

const LEAST_HZ = 8000, MOST_HZ = 96000, AHEAD_S = 0.15;
export const sound = { context: null, entry: null, lane: "", next: 0, pace: 1 };

export function listenTo(select) {
  if (rate < LEAST_HZ || rate > MOST_HZ) {
    select.disabled = true;
    select.title = `a browser plays ${LEAST_HZ} to ${MOST_HZ} samples a second, not ${rate}`;
  }
  select.addEventListener("change", () => {
    sound.lane = select.value;
    if (sound.lane === "" || sound.context) return;
    const context = (sound.context = new AudioContext());
    // A steady force is no sound.
    const high = new BiquadFilterNode(context, { type: "highpass", frequency: 30 });
    sound.entry = new GainNode(context, { gain: 0.5 });
    sound.entry.connect(high).connect(new DynamicsCompressorNode(context)).connect(context.destination);
  });
}

export function keepPace(pace) {
  sound.pace = Math.min(Math.max(pace || 1, 0.1), 2);
}

function play(record, count) {
  const { context, lane } = sound;
  if (!context || lane === "" || !count) return;
  const buffer = context.createBuffer(1, count, rate);
  buffer.copyToChannel(record.subarray((2 + Number(lane)) * count, (3 + Number(lane)) * count), 0);
  const source = new AudioBufferSourceNode(context, { buffer, playbackRate: sound.pace });
  source.connect(sound.entry);
  if (sound.next < context.currentTime || sound.next > context.currentTime + 4 * AHEAD_S) {
    sound.next = context.currentTime + AHEAD_S;
  }
  source.start(sound.next);
  sound.next += count / rate / sound.pace;
}
