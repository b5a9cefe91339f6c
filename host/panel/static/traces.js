// The traces of the board: the signals of the last seconds, one strip each, on one canvas. They can stand still while
// the data goes on.

import { hear, board } from "./live.js";
import { FONT, NAME, cleared, colours, number, strip, ticks } from "./canvas.js";
import { beginSignals, shownSignals } from "./signals.js";
import { beginCursors, cursors, placeOf, sayCursors } from "./cursors.js";

const SHOWN_S = 10, KEPT = 1200, LEFT = 58, RIGHT = 96, FOOT = 24, STRIP = 102;
const find = (id) => document.getElementById(id);
export const samples = [];
let fresh = false, frozen = null; // while they stand still: the samples that are shown

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

// The last sample that came, whether the traces stand still or not.
export function latest() {
  return samples[samples.length - 1];
}

// The samples that are drawn and measured.
export function drawnSamples() {
  return frozen || samples;
}

function pause() {
  frozen = frozen ? null : samples.slice();
  find("pause").setAttribute("aria-pressed", Boolean(frozen));
  find("still").hidden = !frozen;
  find("paused").textContent = frozen ? "The traces stand still. The board goes on, and is read on." : "";
  sayReadout();
}

export function beginTraces(canvas) {
  const ageAt = (x) => SHOWN_S * (1 - (x - LEFT) / Math.max(canvas.clientWidth - LEFT - RIGHT, 1));
  find("pause").addEventListener("click", pause);
  beginSignals(find("signals"), (signal) => range(signal, drawnSamples(), firstOf(drawnSamples())));
  beginCursors(canvas, SHOWN_S, ageAt, sayReadout);
}

// Writes what stands beside the drawing: for how long it stands still, and what is at the cursors.
export function sayReadout() {
  if (frozen && frozen.length) {
    find("since").textContent = `They are ${number(latest()[0] - frozen[frozen.length - 1][0], 1)} s old.`;
  }
  sayCursors(drawnSamples());
}

// What the drawing shows last, in words.
export function sayTraces(canvas) {
  const values = shownSignals().map(({ name, unit, column, scale, decimals }) => {
    return samples.length ? `${name} ${number(latest()[column] * scale, decimals)} ${unit}` : `no ${name} yet`;
  });
  const paused = frozen ? "the traces stand still" : `and the last ${SHOWN_S} s of each`;
  const said = values.length ? `${values.join(", ")}; ${paused}` : "no signal is chosen";
  canvas.setAttribute("aria-label", `What the board shows: ${said}`);
}

// The place of the first sample that is drawn.
function firstOf(drawn) {
  let first = drawn.length;
  while (first > 0 && drawn[first - 1][0] > drawn[drawn.length - 1][0] - SHOWN_S) first--;
  return first;
}

function range(signal, drawn, first) {
  if (signal.range) return signal.range;
  let low = Infinity, high = -Infinity;
  for (let k = first; k < drawn.length; k++) {
    const value = drawn[k][signal.column] * signal.scale;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) [low, high] = [0, 0];
  const spare = Math.max((high - low) * 0.08, (signal.least - (high - low)) / 2, 0);
  return [low - spare, high + spare];
}

function drawLine(context, box, signal, drawn, first, across, at) {
  context.save();
  context.beginPath();
  context.rect(box.left, box.top, box.width, box.height);
  context.clip();
  context.strokeStyle = colours[signal.colour];
  context.lineWidth = 1.6;
  context.beginPath();
  for (let k = first; k < drawn.length; k++) {
    context.lineTo(across(drawn[k][0]), at(drawn[k][signal.column] * signal.scale));
  }
  context.stroke();
  context.restore();
}

// The last value, beside its strip; beyond a range that is set by hand it stands at the edge.
function drawValue(context, box, signal, sample, at) {
  const value = sample[signal.column] * signal.scale;
  const beside = Math.min(Math.max(at(value), box.top), box.top + box.height);
  context.fillStyle = board.told && board.told.state === "SILENT" ? colours.pale : colours[signal.colour];
  context.font = "600 17px Roboto, sans-serif";
  context.textAlign = "left";
  context.fillText(number(value, signal.decimals), box.left + box.width + 8, beside);
}

function drawCursors(context, drawn, across, height) {
  ["A", "B"].forEach((name, which) => {
    const place = placeOf(drawn, cursors.ages[which]);
    if (place < 0) return;
    const x = across(drawn[place][0]);
    context.fillStyle = colours.ink;
    context.fillRect(x - 0.75, 14, 1.5, height - FOOT - 14);
    context.font = "600 13px Roboto, sans-serif";
    context.textAlign = "center";
    context.fillText(name, x, 7);
  });
}

function drawTimes(context, box, across, now, height) {
  context.textAlign = "center";
  context.fillStyle = colours.pale;
  context.font = FONT;
  for (const value of ticks(-SHOWN_S, 0, Math.min(5, box.width / 60)).values) {
    context.fillText(`${number(value, 0)} s`, across(now + value), height - 9);
  }
}

export function drawTraces(canvas) {
  const signals = shownSignals(), drawn = drawnSamples();
  canvas.style.height = `${Math.max(signals.length, 1) * STRIP + FOOT}px`;
  const { context, width, height } = cleared(canvas);
  const box = { left: LEFT, width: width - LEFT - RIGHT, height: STRIP - NAME, top: NAME };
  if (!signals.length) {
    context.fillStyle = colours.pale;
    return context.fillText("No signal is chosen: choose one under Signals and ranges.", 8, height / 2);
  }
  const now = drawn.length ? drawn[drawn.length - 1][0] : 0, first = firstOf(drawn);
  const across = (time) => LEFT + box.width * (1 - (now - time) / SHOWN_S);
  for (const signal of signals) {
    const at = strip(context, box, ...range(signal, drawn, first), `${signal.name}, ${signal.unit}`);
    drawLine(context, box, signal, drawn, first, across, at);
    if (drawn.length) drawValue(context, box, signal, drawn[drawn.length - 1], at);
    box.top += STRIP;
  }
  if (cursors.on) drawCursors(context, drawn, across, height);
  drawTimes(context, box, across, now, height);
}
