// All registers of the board: read while they are shown, and found by a filter. Nothing is written from here.

import { LIVE, board, hear, send } from "./live.js";

const find = (id) => document.getElementById(id);
const items = new Map(); // by the names of registers: what shows them, and the text that is searched
let open = new Set(); // the blocks that were open before there was a filter
let filtered = false;

export function beginRegisters() {
  for (const item of find("tree").querySelectorAll("[data-register]")) {
    const text = `${item.closest(".branch").querySelector("summary").textContent} ${item.textContent}`.toLowerCase();
    const [value, word] = ["value", "word"].map((name) => item.querySelector(`.${name}`));
    items.set(item.dataset.register, { item, text, value, word });
  }
  find("filter").addEventListener("input", filter);
  find("registers").addEventListener("toggle", forget);
  filter();
}

// What was read the last time that it was open is not shown as if it were of now.
function forget() {
  if (find("registers").open) return;
  find("rate").textContent = "Nothing is read yet.";
  for (const { value, word } of items.values()) {
    if (value.textContent) value.textContent = "not read yet";
    word.textContent = "";
  }
}

// Shows the registers that have every word of the filter in their name, block, unit or address.
function filter() {
  const words = find("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const blocks = [...find("tree").querySelectorAll(".branch")];
  if (words.length && !filtered) open = new Set(blocks.filter((block) => block.open));
  let count = 0;
  for (const { item, text } of items.values()) {
    item.hidden = !words.every((word) => text.includes(word));
    count += !item.hidden;
  }
  for (const block of blocks) {
    block.hidden = !block.querySelector("li:not([hidden])");
    // What is found is seen; without a filter the blocks are as a person left them.
    if (words.length) block.open = !block.hidden;
    else if (filtered) block.open = open.has(block);
  }
  filtered = words.length > 0;
  find("found").textContent = `${count} of ${items.size} registers`;
}

// Asks for the registers again and again while they are shown: a tab that hangs, or is hidden, does not ask.
export function askForRegisters() {
  if (!find("registers").open) return;
  if (board.told && LIVE.includes(board.told.state)) send({ do: "registers" });
  else find("rate").textContent = "Nothing is read while no board answers: what is shown is old.";
}

hear("registers", ({ registers, period_s }) => {
  if (!find("registers") || !find("registers").open) return;
  for (const [name, [said, raw]] of Object.entries(registers)) {
    const shown = items.get(name);
    if (!shown) continue;
    if (shown.value.textContent !== said) shown.value.textContent = said;
    if (shown.word.textContent !== raw) shown.word.textContent = raw;
  }
  const rate = `All of them are read every ${period_s.toPrecision(2)} s, so that this takes at most a fifth of the line.`;
  if (find("rate").textContent !== rate) find("rate").textContent = rate;
});
