// The hand: a drawing of handle, wall and force, on which the handle is dragged.

import { board, send } from "./live.js";
import { cleared, colours, number, ticks } from "./canvas.js";
import { latest } from "./traces.js";

const SHOWN_MM = 50, SHOULDER_MM = 18, FLOOR = 34, HANDLE = 30;
const STEPS_MM = { ArrowLeft: -0.5, ArrowDown: -0.5, ArrowRight: 0.5, ArrowUp: 0.5, PageDown: -5, PageUp: 5 }; // by keys
export const view = { from: null };
let dragged = null;

// Returns where the drawing begins, mm: the wall is in view, and the handle too.
function beginning(wall, left, at) {
  const wanted = left ? wall - SHOULDER_MM : wall - SHOWN_MM + SHOULDER_MM;
  let from = wanted;
  if (at < from + 4) from = at - 4;
  if (at > from + SHOWN_MM - 4) from = at + 4 - SHOWN_MM;
  view.from = view.from === null ? from : view.from + (from - view.from) * 0.2;
  return dragged === null ? view.from : (view.from = view.before);
}

export function release() {
  if (dragged !== null) send({ do: "free" });
  dragged = null;
}

export function listen(canvas) {
  const place = (event) => view.from + (event.offsetX / canvas.clientWidth) * SHOWN_MM;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    view.before = view.from;
    dragged = place(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (dragged !== null && canvas.hasPointerCapture(event.pointerId)) dragged = place(event);
  });
  for (const end of ["pointerup", "pointercancel", "blur"]) {
    canvas.addEventListener(end, release);
  }
  canvas.addEventListener("keydown", (event) => {
    const step = STEPS_MM[event.key], sample = latest();
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    if (event.key === "Enter" || event.key === " ") release();
    else if (step !== undefined && sample) {
      if (dragged === null) [dragged, view.before] = [sample[1] * 1e3, view.from];
      // A wish stays near the hand, which may be slower than keys, or at the end of its reach.
      const hand = board.told && board.told.hand_m ? board.told.hand_m * 1e3 : sample[1] * 1e3;
      dragged = Math.min(Math.max(dragged + step, hand - SHOWN_MM / 2), hand + SHOWN_MM / 2);
      // What is moved by keys stays in view.
      view.before = Math.min(Math.max(view.before, dragged + 4 - SHOWN_MM), dragged - 4);
    } else return;
    event.preventDefault();
  });
}

// What the drawing shows, in words, and where the handle is.
export function sayHand(canvas) {
  const told = board.told, sample = latest();
  if (!sample || !told || !told.wall) return;
  const at = sample[1] * 1e3, wall = told.wall.position * 1e3;
  const parts = [`handle at ${number(at, 1)} mm`];
  if (told.wall.stiffness > 0) {
    const inside = told.wall.left > 0 ? wall - at : at - wall;
    parts.push(`${number(Math.abs(inside), 1)} mm ${inside > 0 ? "inside" : "in front of"} the wall`);
  }
  parts.push(`force ${number(sample[4], 1)} N`, dragged === null ? "free" : `held at ${number(dragged, 1)} mm`);
  canvas.setAttribute("aria-valuenow", at.toFixed(1));
  canvas.setAttribute("aria-valuemin", (view.from ?? 0).toFixed(0));
  canvas.setAttribute("aria-valuemax", ((view.from ?? 0) + SHOWN_MM).toFixed(0));
  canvas.setAttribute("aria-valuetext", parts.join(", "));
}

function hatch(context, x, width, height) {
  context.save();
  context.beginPath();
  context.rect(x, 0, width, height);
  context.clip();
  context.fillStyle = colours.wall;
  context.fillRect(x, 0, width, height);
  context.strokeStyle = colours.hatch;
  context.lineWidth = 1;
  context.beginPath();
  for (let k = x - height; k < x + width; k += 12) {
    context.moveTo(k, height);
    context.lineTo(k + height, 0);
  }
  context.stroke();
  context.restore();
}

function arrow(context, x, y, length) {
  const way = Math.sign(length), head = Math.min(9, Math.abs(length));
  context.strokeStyle = context.fillStyle = colours.red;
  context.lineWidth = 4;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + length - way * head, y);
  context.stroke();
  context.beginPath();
  context.moveTo(x + length, y);
  context.lineTo(x + length - way * head, y - 7);
  context.lineTo(x + length - way * head, y + 7);
  context.fill();
}

export function drawHand(canvas) {
  // The drag is told again and again, so that a hand that hangs is none.
  if (dragged !== null) send({ do: "hold", m: dragged / 1e3 });
  const { context, width, height } = cleared(canvas);
  const told = board.told, sample = latest();
  if (!sample || !told || !told.wall) return;
  const at = sample[1] * 1e3, force = sample[4];
  const wall = told.wall.position * 1e3, left = told.wall.left > 0, exists = told.wall.stiffness > 0;
  const from = beginning(wall, left, at), scale = width / SHOWN_MM;
  const across = (mm) => (mm - from) * scale, ground = height - FLOOR, middle = ground - HANDLE / 2;
  if (exists) {
    const edge = across(wall);
    if (left) hatch(context, 0, Math.max(edge, 0), ground);
    else hatch(context, edge, Math.max(width - edge, 0), ground);
    context.fillStyle = colours.red;
    context.fillRect(edge - 1, 0, 3, ground);
    context.textAlign = left ? "right" : "left";
    context.font = "12px Roboto, sans-serif";
    context.fillText("wall", edge + (left ? -8 : 8), 12);
  }
  context.fillStyle = colours.ink;
  context.fillRect(0, ground, width, 2);
  context.textAlign = "center";
  context.fillStyle = colours.pale;
  for (const mm of ticks(from, from + SHOWN_MM, Math.min(10, width / 60)).values) {
    context.fillStyle = colours.grid;
    context.fillRect(across(mm), ground + 2, 1, 6);
    context.fillStyle = colours.pale;
    context.fillText(`${number(mm, 0)} mm`, across(mm), ground + 18);
  }
  const x = across(at);
  context.font = "600 15px Roboto, sans-serif";
  context.fillStyle = colours.blue;
  context.beginPath();
  context.roundRect(x - HANDLE, ground - HANDLE, HANDLE, HANDLE, 5);
  context.fill();
  context.fillRect(x - HANDLE / 2 - 3, ground - HANDLE - 22, 6, 24);
  context.beginPath();
  context.arc(x - HANDLE / 2, ground - HANDLE - 26, 11, 0, 7);
  context.fill();
  if (told.hand_m !== null && told.hand_m !== undefined) {
    const hand = across(told.hand_m * 1e3) - HANDLE / 2;
    context.strokeStyle = colours.ink;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(hand, ground - HANDLE - 26, 15, 0, 7);
    context.moveTo(hand, ground - HANDLE - 26);
    context.lineTo(x - HANDLE / 2, ground - HANDLE - 26);
    context.stroke();
  }
  if (Math.abs(force) > 0.02) {
    arrow(context, force < 0 ? x - HANDLE - 4 : x + 4, middle, Math.max(-150, Math.min(150, force * 8)));
    context.fillStyle = colours.red;
    context.textAlign = force < 0 ? "right" : "left";
    context.fillText(`${number(force, 2)} N`, force < 0 ? x - HANDLE - 8 : x + 8, middle - 18);
  }
}
