// The signals of the traces: which are shown, and whether their range follows them or is set by hand.

// `column` is the place in a sample, `scale` how many of the unit the SI unit has, and `least` the smallest range that
// follows the signal; `range` is the one that is set by hand, or null.
const ACCELERATION = {
  ...{ name: "acceleration", unit: "m/s\u00b2", column: 5, scale: 1, colour: "grey" },
  ...{ least: 1, decimals: 2, shown: false, range: null },
};
export const SIGNALS = [
  { name: "position", unit: "mm", column: 1, scale: 1e3, colour: "blue", least: 1, decimals: 3, shown: true, range: null },
  { name: "velocity", unit: "mm/s", column: 2, scale: 1e3, colour: "green", least: 20, decimals: 1, shown: true, range: null },
  ...(window.hardwallAccelerates ? [ACCELERATION] : []), // a board with an estimator that has one
  { name: "wall force", unit: "N", column: 3, scale: 1, colour: "violet", least: 1, decimals: 2, shown: false, range: null },
  { name: "force", unit: "N", column: 4, scale: 1, colour: "red", least: 1, decimals: 2, shown: true, range: null },
];
const FINITE = 1e9; // the largest end of a range, either way

export function shownSignals() {
  return SIGNALS.filter((signal) => signal.shown);
}

function made(parent, kind, values = {}) {
  const element = Object.assign(document.createElement(kind), values);
  parent.append(element);
  return element;
}

function box(parent, text, checked, label) {
  const about = made(parent, "label");
  const input = made(about, "input", { type: "checkbox", checked });
  about.append(` ${text}`);
  if (label) input.setAttribute("aria-label", label);
  return input;
}

function field(parent, text, label) {
  const about = made(parent, "label", { textContent: `${text} ` });
  const input = made(about, "input", { type: "number", step: "any", disabled: true });
  input.setAttribute("aria-label", label);
  return input;
}

// Builds a row of controls for every signal. `rangeOf` returns the range that follows a signal now.
export function beginSignals(parent, rangeOf) {
  for (const signal of SIGNALS) {
    const row = made(parent, "div", { className: "signal" });
    const named = `${signal.name}, ${signal.unit}`;
    const shown = box(row, named, signal.shown);
    const follows = box(row, "automatic", true, `Range of ${named}: automatic`);
    const low = field(row, "from", `Range of ${named}: from`), high = field(row, "to", `Range of ${named}: to`);
    const wrong = made(row, "span", { className: "wrong" });
    wrong.setAttribute("aria-live", "polite");
    const take = () => {
      const [from, to] = [low, high].map((each) => (each.value === "" ? NaN : Number(each.value)));
      const fits = from < to && Math.max(Math.abs(from), Math.abs(to)) <= FINITE;
      if (fits) signal.range = [from, to];
      wrong.textContent = fits ? "" : `from must be a number below to, both within \u00b1${FINITE.toExponential()} ${signal.unit}`;
      for (const each of [low, high]) each.setAttribute("aria-invalid", !fits);
    };
    shown.addEventListener("change", () => (signal.shown = shown.checked));
    follows.addEventListener("change", () => {
      low.disabled = high.disabled = follows.checked;
      signal.range = null;
      // A range by hand begins as the one that is seen.
      if (!follows.checked) [low.value, high.value] = rangeOf(signal).map((value) => Number(value.toPrecision(7)));
      if (follows.checked) wrong.textContent = "";
      else take();
    });
    for (const each of [low, high]) each.addEventListener("input", take);
  }
}
