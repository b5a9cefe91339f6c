// The socket to the board. What is sent has the time of the wish, so that nothing is done late that was kept on its way;
// without a connection it is not sent at all.

export const ALIVE_MS = 100; // the time between two signs of life; the board's lease lasts five of them
export const LIVE = ["DISARMED", "ARMED", "TRIPPED"]; // the states of a board that is reached
const AGAIN_MS = 1000; // the time until a lost socket is opened again
const QUIET_MS = 1500; // the time without a sample after which what is shown is old
const TIMED = 256; // the messages of some seconds, of which the fastest tells the server's time

export const board = { told: null };
let heard = 0, truth = null, old = false; // `truth` is what was told last
const hearers = { told: [], samples: [], records: [], registers: [] };
let socket = null;
const leads = []; // the server's time less ours, s, by the last messages: too small by the time that each took

export function hear(what, hearer) {
  hearers[what].push(hearer);
}

// Returns the server's time, s; null while it is not known.
export function now() {
  return leads.length ? Math.max(...leads) + performance.now() / 1e3 : null;
}
window.hardwallNow = now; // for the events of controls

export function send(message) {
  const at_s = now();
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ ...message, at_s }));
}

function tell(what, value) {
  for (const hearer of hearers[what]) {
    try {
      hearer(value);
    } catch (error) {
      window.reportError(error); // and the others hear it
    }
  }
}

function lose() {
  const why = "This page has lost the program behind it.";
  board.told = { state: "NO PANEL", why, do: "The board is disarmed, or trips.", may: [], said: "", broken: [] };
  tell("told", board.told);
}

export function open() {
  const url = new URL(`live?tab=${window.hardwallTab}`, window.location.href);
  url.protocol = url.protocol.replace("http", "ws");
  socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  socket.onmessage = (event) => {
    if (event.data instanceof ArrayBuffer) return tell("records", new Float32Array(event.data));
    const message = JSON.parse(event.data);
    leads.push(message.at_s - performance.now() / 1e3);
    if (leads.length > TIMED) leads.shift();
    if (message.told) truth = message.told;
    if (message.samples || !old) heard = performance.now();
    if (message.told || (message.samples && old)) {
      old = false;
      tell("told", (board.told = truth));
    }
    if (message.samples) tell("samples", message.samples);
    if (message.registers) tell("registers", message);
  };
  socket.onclose = () => {
    leads.length = 0;
    lose();
    setTimeout(open, AGAIN_MS);
  };
}

// Says so when what is shown is old, although nobody has said why.
export function look() {
  const told = board.told;
  if (!told || !LIVE.includes(told.state) || performance.now() - heard < QUIET_MS) return;
  const why = "Nothing has come from the board for a while.";
  old = true;
  tell("told", (board.told = { ...told, state: "SILENT", why, do: "What is shown is old." }));
}

// A tab that nobody sees does not hold a board: browsers slow it down anyway.
function hide() {
  if (board.told && board.told.holds) send({ do: "disarm" });
}
document.addEventListener("visibilitychange", () => document.hidden && hide());
window.addEventListener("pagehide", hide);
