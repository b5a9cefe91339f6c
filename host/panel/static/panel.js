// The page: its head, its buttons, and the loop that draws and shows that the tab lives.

import { ALIVE_MS, LIVE, board, hear, look, open, send } from "./live.js";
import { beginTraces, drawTraces, sayReadout, sayTraces, takeFresh } from "./traces.js";
import { askForRegisters, beginRegisters } from "./registers.js";
import { drawHand, listen, release, sayHand } from "./hand.js";
import { begin, drawEstimates, keepPace, listenTo, sayEstimates } from "./estimates.js";

const find = (id) => document.getElementById(id);
const ACTS = ["arm", "disarm", "acknowledge", "connect"];
const DRAWINGS = { traces: drawTraces, hand: drawHand, estimates: drawEstimates };
const TEXTS = { traces: sayTraces, hand: sayHand, estimates: sayEstimates };
const SAY_MS = 500; // the time between two texts of a drawing
const drawn = []; // the times of the frames that had something new
let identity = "", pinged = 0, said = 0;

function act(name) {
  if (name === "acknowledge") send({ do: name, latched: board.told.latched });
  else send({ do: name });
}

hear("told", (told) => {
  find("head").dataset.state = told.state;
  for (const name of ["state", "why", "do", "said"]) {
    // What is written again may be read out again.
    if (find(name).textContent !== told[name]) find(name).textContent = told[name];
  }
  for (const name of ACTS) find(name).disabled = !told.may.includes(name);
  find("connect").hidden = !told.may.includes("connect");
  const old = !LIVE.includes(told.state), locked = Boolean(told.locked);
  document.body.classList.toggle("locked", locked);
  document.body.classList.toggle("old", old);
  // What cannot be done now cannot be asked for, with keys neither.
  for (const part of document.querySelectorAll("aside, .asks, #hand")) part.inert = old || locked;
  // A clock that stands makes a board silent, and must be started again.
  for (const button of document.querySelectorAll(".fault")) button.disabled = locked || (old && told.state !== "SILENT");
  if (old || locked) release();
  document.title = `${told.state} – hardwall`;
  keepPace(told.pace);
  if (told.identity) {
    // Another board has other words: the page is built anew.
    if (identity && identity !== told.identity) window.location.reload();
    identity = told.identity;
    find("identity").textContent = `board ${identity}`;
  }
  for (const button of document.querySelectorAll(".fault")) {
    button.classList.toggle("broken", told.broken ? told.broken.includes(button.dataset.fault) : false);
  }
});

function pace(now) {
  while (drawn.length && drawn[0] < now - 1000) drawn.shift();
  const told = board.told;
  if (!told || !told.pace) return (find("pace").textContent = "");
  const flags = told.flags.length ? ` · ${told.flags.join(", ").replaceAll("_", " ")}` : "";
  const looks = `read ${told.looks_hz.toFixed(0)} times a second, drawn ${drawn.length} times`;
  find("pace").textContent = `${told.pace.toFixed(2)} of real time · ${looks}${flags}`;
}

const failed = new Set(); // the parts that could not be drawn last time

// Draws a part of the page. One that fails is told once, and ends no other one.
function isolated(name, draw) {
  try {
    draw();
    failed.delete(name);
  } catch (error) {
    if (!failed.has(name)) window.reportError(error);
    failed.add(name);
  }
}

function frame(now) {
  // Whatever fails below, there is a next frame.
  window.requestAnimationFrame(frame);
  // The tab lives as long as it draws: one that hangs, or is hidden, does not renew the lease.
  if (now - pinged >= ALIVE_MS) {
    pinged = now;
    send({ do: "ping" });
    isolated("pace", () => pace(now));
    isolated("look", look);
  }
  if (takeFresh()) drawn.push(now);
  const say = now - said >= SAY_MS;
  if (say) {
    said = now;
    isolated("readout", sayReadout);
    isolated("registers", askForRegisters);
  }
  for (const [name, draw] of Object.entries(DRAWINGS)) {
    const canvas = find(name);
    if (!canvas) continue;
    isolated(name, () => draw(canvas));
    if (say) isolated(`${name} in words`, () => TEXTS[name](canvas));
  }
}

// The page's elements are there a moment after its scripts.
function start() {
  if (!find("head") || !find("traces")) return window.requestAnimationFrame(start);
  for (const name of ACTS) find(name).addEventListener("click", () => act(name));
  document.addEventListener("keydown", (event) => event.key === "Escape" && act("disarm"));
  for (const button of document.querySelectorAll(".fault")) {
    button.addEventListener("click", () => send({ do: "turn", fault: button.dataset.fault }));
  }
  if (find("hand")) listen(find("hand"));
  if (find("estimates")) {
    begin(find("estimates"));
    listenTo(find("sound"));
  }
  isolated("traces", () => beginTraces(find("traces")));
  isolated("registers", beginRegisters);
  open();
  window.requestAnimationFrame(frame);
}
start();
