/** Files that are dropped anywhere, pasted or chosen: checked, sent, and handed on to the page of their answers. */

import { ApiError, info, upload } from "./api.js";
import { announce, element, sized } from "./dom.js";
import { go, href } from "./router.js";

const ANSWERS = 48;
/** Files that say of themselves how many dimensions they have. */
const DIMENSIONS = [[2, /\.(png|gif|jpe?g|bmp|webp|p[gbpn]m)$/i], [3, /\.(obj|off|ply|stl|glb)$/i]];
let sending = null;

/** Take files from now on: by drop, paste, and the button of the header. */
export function takeFiles() {
  const chooser = document.getElementById("file");
  document.getElementById("open-file").addEventListener("click", () => chooser.click());
  chooser.addEventListener("change", () => {
    const [file] = chooser.files;
    if (file) searchBy(file);
    chooser.value = "";
  });
  info().then(({ suffixes }) => chooser.setAttribute("accept", suffixes.join(","))).catch(() => {});
  addEventListener("paste", (event) => {
    const [file] = event.clipboardData?.files ?? [];
    if (file) searchBy(file);
  });
  drops();
}

function drops() {
  const overlay = element("div", { class: "overlay", "aria-hidden": "true" });
  document.body.append(overlay);
  let depth = 0;
  const carriesFiles = (event) => event.dataTransfer?.types.includes("Files");
  const leave = () => {
    depth = 0;
    overlay.classList.remove("shown");
  };
  addEventListener("dragenter", (event) => {
    if (!carriesFiles(event)) return;
    depth += 1;
    if (depth === 1) describe(overlay);
    overlay.classList.add("shown");
  });
  addEventListener("dragleave", (event) => {
    depth -= 1;
    if (depth <= 0 || !event.relatedTarget) leave();
  });
  addEventListener("dragover", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
  });
  addEventListener("drop", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    leave();
    const [file] = event.dataTransfer.files;
    if (file) searchBy(file);
  });
  addEventListener("keydown", (event) => event.key === "Escape" && leave());
}

async function describe(overlay) {
  const box = element("div", { class: "overlay-box" }, element("p", { class: "overlay-title" }, "Drop a shape to search"));
  overlay.replaceChildren(box);
  try {
    const { suffixes, limits } = await info();
    box.append(element("p", {}, `${suffixes.join("  ")}`), element("p", {}, `up to ${sized(limits.upload_bytes)}`));
  } catch {
    box.append(element("p", {}, "An image, a mesh or a volume"));
  }
}

/** Why a file would be refused, or "" where it would not. */
export function refusal(file, { suffixes, limits }) {
  const name = file.name.toLowerCase();
  if (!suffixes.some((suffix) => name.endsWith(suffix))) {
    return `${file.name} is of no kind that is read here: ${suffixes.join(", ")}`;
  }
  if (file.size > limits.upload_bytes) {
    return `${file.name} has ${sized(file.size)}; this server takes up to ${sized(limits.upload_bytes)}.`;
  }
  return file.size === 0 ? `${file.name} is empty.` : "";
}

/** The model to search with: that which is looked at, unless it is of other dimensions than the file. */
export function modelFor(file, { models, model }) {
  const [ndim] = DIMENSIONS.find(([, suffix]) => suffix.test(file.name)) ?? [];
  const fits = (one) => !ndim || !one.ndim || one.ndim === ndim;
  const current = models.find(({ digest }) => digest === model);
  if (!current || fits(current)) return model;
  return models.find(fits)?.digest ?? model;
}

/** Send a file and go to its answers. */
export async function searchBy(file) {
  sending?.abort();
  const control = new AbortController();
  sending = control;
  const panel = new Panel(file.name, () => control.abort());
  try {
    const known = await info();
    const refused = refusal(file, known);
    if (refused) throw new ApiError(refused);
    panel.say(`Sending ${sized(file.size)}`);
    const model = known.models.length > 1 ? modelFor(file, known) : null;
    const onProgress = (share) => panel.show(share);
    const options = { fields: { k: ANSWERS }, parameters: { model }, onProgress, signal: control.signal };
    const { job } = await upload("api/search", file, options);
    panel.close();
    if (sending === control) await go(href("./", model ? { model, job } : { job }));
  } catch (error) {
    if (error.name === "AbortError") panel.close();
    else panel.fail(error.message, error.status ? () => searchBy(file) : null);
  }
}

/** What is being sent, at the lower edge of the page. */
class Panel {
  constructor(name, cancel) {
    document.querySelector(".panel")?.remove();
    this.text = element("p", { class: "panel-text" }, "Preparing");
    this.bar = element("progress", { max: 1, value: 0, "aria-label": `Sending ${name}` });
    this.button = element("button", { type: "button", class: "button small", onclick: cancel }, "Cancel");
    const words = element("div", { class: "panel-words" }, element("p", { class: "panel-name" }, name), this.text, this.bar);
    this.box = element("aside", { class: "panel", "aria-label": "File" }, words, this.button);
    document.body.append(this.box);
  }

  say(text) {
    this.text.textContent = text;
    announce(text);
  }

  show(share) {
    this.bar.value = share;
    if (share >= 1) this.say("Waiting for the server");
  }

  fail(message, again) {
    this.box.classList.add("failed");
    this.bar.remove();
    this.say(message);
    this.button.textContent = "Close";
    this.button.addEventListener("click", () => this.close());
    if (again) {
      this.button.before(element("button", { type: "button", class: "button small", onclick: again }, "Try again"));
    }
  }

  close() {
    this.box.remove();
  }
}
