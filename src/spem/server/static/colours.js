/** Palettes that read correctly with every common kind of colour blindness, as tables of 256 packed colours. */

const VIRIDIS = ["#440154", "#482475", "#414487", "#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"];
const CIVIDIS = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];
const BLUE_RED = ["#0b3c7a", "#2166ac", "#4f97c9", "#9cc9e2", "#d9e8f1", "#f4f2ef", "#fbdcc8", "#f2a884", "#d9654d", "#b2182b", "#75081f"];
// On a dark ground the middle is darker than the ends, so that what is near zero recedes there too.
const BLUE_RED_DARK = ["#b7dcff", "#8cc4f5", "#62a3df", "#4d86bd", "#5a7893", "#747980", "#96716b", "#bd6a5c", "#df7a66", "#f59a85", "#ffcdbf"];

// Okabe and Ito's, then each the farthest from those before it, as the pictures of the package have them.
const PARTS = [
  "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442",
  "#960f3c", "#96f0a5", "#785a78", "#f0d2ff", "#1e5a4b", "#8778f0", "#784b00",
  "#69784b", "#b4b478", "#4b3ca5", "#87b496", "#c31e2d", "#a5874b",
];
const NO_PART = "#b9bfc6";
/** Levels of a table of parts that no part has. */
export const UNEXPLAINED = 255;

function channels(hex) {
  return [1, 3, 5].map((from) => parseInt(hex.slice(from, from + 2), 16));
}

/** Red, green and blue in one number, in the order of a picture's bytes. */
function packed([red, green, blue]) {
  return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}

/** A #rrggbb colour as a picture's bytes. */
export function packedColour(hex) {
  return packed(channels(hex));
}

/** Table of 256 colours that goes evenly through some. */
function ramp(stops) {
  const table = new Uint32Array(256);
  const points = stops.map(channels);
  for (let level = 0; level < 256; level += 1) {
    const place = (level / 255) * (points.length - 1);
    const from = Math.min(Math.floor(place), points.length - 2);
    const share = place - from;
    table[level] = packed(points[from].map((value, i) => Math.round(value + (points[from + 1][i] - value) * share)));
  }
  return table;
}

export const SEQUENTIAL = ramp(VIRIDIS);
export const LOGARITHMIC = ramp(CIVIDIS);
const ON_LIGHT = ramp(BLUE_RED);
const ON_DARK = ramp(BLUE_RED_DARK);

/** Whether the page is dark, as the reader or the system chose. */
export function isDark() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

/** The table of signed values, zero in its middle. */
export function diverging() {
  return isDark() ? ON_DARK : ON_LIGHT;
}

/** Colour of a part by its label, as #rrggbb; negative labels are what no part explains. */
export function partColour(label) {
  return label < 0 ? NO_PART : PARTS[label % PARTS.length];
}

/** Table of the colours of parts by label; all but one are faded where one is picked out. */
export function partTable(count, picked = null) {
  const table = new Uint32Array(256).fill(packedColour(NO_PART));
  const ground = channels(isDark() ? "#262b33" : "#e9ecf0");
  for (let label = 0; label < count; label += 1) {
    const own = channels(partColour(label));
    const faded = own.map((value, i) => Math.round(ground[i] + 0.16 * (value - ground[i])));
    table[label] = packed(picked === null || picked === label ? own : faded);
  }
  if (picked !== null) table[UNEXPLAINED] = packed(ground);
  return table;
}

/** One packed colour as CSS has it. */
export function css(colour) {
  return `rgb(${colour & 255} ${(colour >> 8) & 255} ${(colour >> 16) & 255})`;
}

/** Three shares of a #rrggbb colour, each from 0 to 1. */
export function shares(hex) {
  return channels(hex).map((value) => value / 255);
}

/** A table as a CSS gradient from left to right. */
export function gradient(table) {
  const stops = [];
  for (let level = 0; level < 256; level += 15) stops.push(css(table[level]));
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

/** Call when the theme changes; the call returned stops that. */
export function onTheme(call) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const watcher = new MutationObserver(call);
  watcher.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
  system.addEventListener("change", call);
  return () => {
    watcher.disconnect();
    system.removeEventListener("change", call);
  };
}
