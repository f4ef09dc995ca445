/** The map of the collection: shapes that are alike lie near each other. */

import { json } from "./api.js";
import { picture } from "./cards.js";
import { announce, counted, debounced, element, icon, notice } from "./dom.js";
import { legend } from "./map_legend.js";
import { MapPicture } from "./map_picture.js";
import { MapView } from "./map_view.js";
import { go, href } from "./router.js";

const LISTED = 60;

/** Draw the map. */
export async function renderMap(root, _parameters, state, setState) {
  document.title = "Map · spem";
  const count = element("p", { class: "count" }, "Arranging the shapes");
  root.append(element("div", { class: "heading" }, element("h1", {}, "Map"), count));
  const control = new AbortController();
  const page = { destroy: () => control.abort() };
  json("api/map", {}, control.signal)
    .then((found) => {
      count.textContent = described(found);
      if (!found.points.length) {
        root.append(notice("Nothing to arrange yet", "The index has no shape."));
        return;
      }
      const map = new CollectionMap(root, found.points, setState);
      map.update(state);
      page.update = (changed) => map.update(changed);
      page.destroy = () => map.stop();
    })
    .catch((error) => {
      if (error.name === "AbortError") return;
      count.remove();
      root.append(notice("The map could not be drawn", error.message));
      announce(error.message);
    });
  return page;
}

function described({ points, total, method }) {
  const part = total > points.length ? ` of ${total.toLocaleString("en")}` : "";
  return `${counted(points.length, "shape")}${part}; near means alike${method ? ` (${method})` : ""}`;
}

/** Points scaled to [-1, 1]², without distortion, with the place of their label: the most frequent first. */
function arranged(points) {
  const range = (key) => {
    const values = points.map((point) => point[key]);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    return { middle: (low + high) / 2, half: (high - low) / 2 };
  };
  const [horizontal, vertical] = [range("x"), range("y")];
  const unit = Math.max(horizontal.half, vertical.half) || 1;
  const counts = new Map();
  for (const { label } of points) counts.set(label, (counts.get(label) ?? 0) + 1);
  const labels = [...counts].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1)).map(([label, n]) => ({ label, n }));
  const place = new Map(labels.map(({ label }, at) => [label, at]));
  const moved = points.map((point) => ({
    ...point,
    x: (point.x - horizontal.middle) / unit,
    y: (point.y - vertical.middle) / unit,
    place: place.get(point.label),
  }));
  const extent = [horizontal.half / unit, vertical.half / unit];
  return { points: moved, extent, labels: labels.some(({ label }) => label) ? labels : [] };
}

class CollectionMap {
  constructor(root, points, setState) {
    Object.assign(this, { root, setState });
    Object.assign(this, arranged(points));
    this.build();
    this.settled = debounced(() => this.settle(), 150);
    this.view = new MapView(this.canvas, this.extent, {
      onMove: () => this.moved(),
      onHover: (place, entered) => this.hover(place, entered),
      onPick: (place, touched) => this.choose(place, touched),
    });
    this.picture = new MapPicture(this.canvas, this.view, this.points, this.labels.length);
    this.legend = legend(this.labels, this.picture, (chosen) => {
      this.setState({ label: chosen });
      this.filter({ ...this.state, label: chosen });
    });
    this.side.firstChild.after(this.legend.box);
    this.retint = () => {
      this.picture.dress();
      this.legend.dress();
    };
    addEventListener("spem-theme", this.retint);
  }

  build() {
    this.canvas = element("canvas", {
      class: "map-canvas", tabindex: "0", role: "application", "aria-describedby": "map-help",
      "aria-label": `Map of ${counted(this.points.length, "shape")}`,
    });
    this.tip = element("a", { class: "map-tip", tabindex: "-1", hidden: true });
    this.tip.addEventListener("pointerleave", () => this.tell(null));
    const tool = (words, act, ...paths) =>
      element("button", { type: "button", class: "button icon", "aria-label": words, title: words, onclick: act }, icon(...paths));
    const tools = element("div", { class: "map-tools" },
      tool("Zoom in", () => this.view.magnify(1.5), "M10 4v12M4 10h12"),
      tool("Zoom out", () => this.view.magnify(1 / 1.5), "M4 10h12"),
      tool("Show all", () => this.view.fit(), "M4 8V4h4M12 4h4v4M16 12v4h-4M8 16H4v-4"));
    const frame = element("div", { class: "map-frame" }, this.canvas, tools, this.tip);
    const typed = debounced((event) => {
      const q = event.target.value.trim() || null;
      this.setState({ q });
      this.filter({ ...this.state, q });
    }, 150);
    this.q = element("input", { type: "search", id: "q", placeholder: "Find by name", "aria-label": "Find shapes by name", oninput: typed });
    this.pictures = element("input", { type: "checkbox", onchange: () => {
      this.setState({ pictures: this.pictures.checked ? null : "off" });
      this.picture.pictures = this.pictures.checked;
      this.picture.draw();
    } });
    this.list = element("ul", { class: "map-list", role: "list" });
    this.listTitle = element("h2", { id: "in-view" }, "In view");
    this.side = element("div", { class: "map-side" },
      element("div", { class: "map-finder" }, this.q, element("label", { class: "check" }, this.pictures, element("span", {}, "Pictures where there is room"))),
      element("section", { "aria-labelledby": "in-view", class: "map-section" }, this.listTitle, this.list));
    const help = "Drag or use the arrow keys to move, the wheel or plus and minus to zoom, 0 to show all. Every shape in view is also in the list.";
    this.root.append(element("div", { class: "map" }, frame, this.side), element("p", { id: "map-help", class: "map-help" }, help));
  }

  update(state) {
    this.q.value = state.q ?? "";
    this.pictures.checked = state.pictures !== "off";
    this.picture.pictures = this.pictures.checked;
    this.filter(state);
    this.view.read(state.view);
  }

  filter(state) {
    this.state = state;
    const labels = new Set([].concat(state.label ?? []));
    const words = (state.q ?? "").toLowerCase();
    const passes = ({ label, name }) => (!labels.size || labels.has(label)) && (!words || name.toLowerCase().includes(words));
    this.legend.choose(labels);
    this.picture.show(this.points.filter(passes));
    this.settled();
  }

  moved() {
    this.picture?.draw();
    if (this.tip && !this.tip.hidden) this.tell(null);
    this.settled();
  }

  /** Once the view rests: its address, and the list of what is in it. */
  settle() {
    if (!this.canvas.isConnected) return;
    this.setState({ view: this.view.write() });
    const { clientWidth, clientHeight } = this.canvas;
    const inside = this.picture.inView().filter(({ px, py }) => px >= 0 && py >= 0 && px <= clientWidth && py <= clientHeight);
    const named = inside.map(({ point }) => point).sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
    this.listTitle.textContent = `In view: ${named.length.toLocaleString("en")}`;
    this.list.replaceChildren(...named.slice(0, LISTED).map((point) => this.entry(point)));
    if (named.length > LISTED) this.list.append(element("li", { class: "facts" }, `and ${(named.length - LISTED).toLocaleString("en")} more; zoom in to list them`));
    this.canvas.dataset.listed = String(named.length);
  }

  entry(point) {
    const on = () => this.picture.mark(point);
    const off = () => this.picture.mark(null);
    const link = element("a", { href: href(`shape/${point.id}`), onfocus: on, onblur: off, onpointerenter: on, onpointerleave: off }, point.name);
    return element("li", {}, link, point.label ? element("span", { class: "facts" }, point.label) : null);
  }

  hover(place, entered) {
    if (!place && entered instanceof Node && this.tip.contains(entered)) return;
    const spot = place && this.picture.pick(place);
    this.canvas.classList.toggle("over-point", Boolean(spot));
    this.tell(spot);
  }

  /** Show the name and picture of a point beside it. */
  tell(spot) {
    this.picture.mark(spot?.point ?? null);
    this.tip.hidden = !spot;
    if (!spot) return;
    const { point, px, py } = spot;
    this.tip.href = href(`shape/${point.id}`);
    if (this.tip.dataset.id !== point.id) {
      this.tip.dataset.id = point.id;
      this.tip.replaceChildren(
        picture({ ndim: "", ...point }, { eager: true }),
        element("span", { class: "name" }, point.name),
        element("span", { class: "facts" }, point.label || "no label"),
      );
    }
    const room = this.canvas.clientWidth - px > 190;
    this.tip.style.left = `${room ? px + 14 : px - 14 - this.tip.offsetWidth}px`;
    this.tip.style.top = `${Math.min(Math.max(py - 70, 8), Math.max(this.canvas.clientHeight - this.tip.offsetHeight - 8, 8))}px`;
  }

  choose(place, touched) {
    const spot = this.picture.pick(place);
    if (!spot) this.tell(null);
    // A finger cannot hover: the first touch tells, the second opens.
    else if (touched && this.picture.marked !== spot.point) this.tell(spot);
    else go(href(`shape/${spot.point.id}`));
  }

  stop() {
    this.picture.stop();
    removeEventListener("spem-theme", this.retint);
  }
}
