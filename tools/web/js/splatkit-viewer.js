// <splatkit-viewer>: scans, volumes and trained scenes in a page.
//
// The engine runs in a worker, so that the page stays responsive. This file has no dependencies;
// docs/browser.md describes its attributes, properties, methods and events.

const STYLE = `
:host { display: block; position: relative; min-height: 8rem; color-scheme: light dark;
  font: 14px/1.4 system-ui, sans-serif; --panel: light-dark(#fffffff0, #1b1f27f2);
  --ink: light-dark(#1a1d22, #e8eaee); --line: light-dark(#0003, #fff3); }
:host([hidden]) { display: none; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none;
  cursor: grab; outline-offset: -2px; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { outline: 2px solid #4c8dff; }
.panel { position: absolute; padding: .4rem .7rem; border-radius: .4rem; color: var(--ink);
  background: var(--panel); border: 1px solid var(--line); }
.status { left: .6rem; bottom: .6rem; pointer-events: none; }
.problem { left: 50%; top: 50%; translate: -50% -50%; max-width: min(34rem, 80%);
  white-space: pre-wrap; }
.help { right: .6rem; top: 2.9rem; margin: 0; max-width: 26rem; }
.help td:first-child { padding-right: 1rem; font-weight: 600; }
.marks { position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none; overflow: hidden; }
.marks line { stroke: #ffd23f; stroke-width: 2; }
.marks circle { fill: #ffd23f; stroke: #000; }
.marks text { fill: #fff; stroke: #000; stroke-width: 3; paint-order: stroke; font-size: 13px; }
canvas.measuring { cursor: crosshair; }
.tools { position: absolute; right: .6rem; top: .6rem; display: flex; gap: .3rem; }
button { display: grid; place-items: center; width: 2rem; height: 2rem; padding: 0; border-radius: .4rem; font: inherit;
  color: var(--ink); background: var(--panel); border: 1px solid var(--line); cursor: pointer;
  opacity: .75; }
button:hover, button:focus-visible { opacity: 1; }
[hidden] { display: none !important; }
`;

const HELP = [
  ["drag, arrows", "turn"],
  ["right drag, Shift+drag, two fingers", "move"],
  ["wheel, pinch, + −", "closer, away"],
  ["double click", "turn about this point"],
  ["Alt+drag, W A S D E Q", "look around, fly"],
  ["1 3 7 0", "front, right, top, a corner"],
  ["Home", "the whole scene"],
  ["O", "perspective on and off"],
  ["M", "measure between two clicks"],
  ["F", "full screen"],
];

/** Drawn, because fonts lack some of these signs. */
const drawn = (path) =>
  `<svg viewBox="0 0 16 16" width="16" height="16" fill="none" stroke="currentColor" stroke-width="1.5" aria-hidden="true"><path d="${path}"/></svg>`;
const ICONS = {
  whole: drawn("M2 8l6-5.5L14 8M4 7v6.5h8V7"),
  ruler: drawn("M1.5 11L11 1.5l3.5 3.5L5 14.5zM4.5 8l1.5 1.5M7 5.5L9 7.5M9.5 3L11 4.5"),
  screen: drawn("M2 6V2h4M10 2h4v4M14 10v4h-4M6 14H2v-4"),
  help: drawn("M5.5 6a2.5 2.5 0 1 1 3.6 2.2C8.4 8.6 8 9 8 10M8 12.2v1.3"),
};

/** The most pixels of a picture: more take seconds on one processor. */
const MOST_PIXELS = 4e6;
/** The part of the way to the focal point that the camera flies in a second. */
const SPEED = 0.5;
const FLIES = { w: [0, 0, 1], s: [0, 0, -1], d: [1, 0, 0], a: [-1, 0, 0], e: [0, 1, 0], q: [0, -1, 0] };
const SIDES = { 1: "front", 3: "right", 7: "top", 0: "iso" };
const OPPOSITES = { 1: "back", 3: "left", 7: "bottom" };

/** Reads the bytes of an address, and says how many there are so far. */
async function fetched(url, hear) {
  let response;
  try {
    response = await fetch(url);
  } catch {
    throw new Error(`${url} cannot be reached. A page opened as a file may not read other files: serve the folder, or publish it as one file.`);
  }
  if (!response.ok) throw new Error(`${url}: the server answers ${response.status} ${response.statusText}`);
  const all = Number(response.headers.get("content-length")) || 0;
  const parts = [];
  let bytes = 0;
  const reader = response.body.getReader();
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    parts.push(part.value);
    bytes += part.value.length;
    hear?.(bytes, all);
  }
  return new Blob(parts).arrayBuffer();
}

/** Where the worker and the engine are. A page in one file has them inside. */
export const resources = {
  worker: () => new Worker(new URL("./splatkit-worker.js", import.meta.url)),
  wasm: (hear) => fetched(new URL("./splatkit.wasm", import.meta.url), hear),
};

/** Files that are read in parts, as the view needs them. */
const IN_PARTS = /\.spl[kv]$/i;

const megabytes = (bytes) => `${(bytes / 1e6).toFixed(1)} MB`;

const difference = (a, b) => a.map((side, axis) => side - b[axis]);
const product = (a, b) => a.reduce((sum, side, axis) => sum + side * b[axis], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = (a) => a.map((side) => side / (Math.hypot(...a) || 1));

/** What is drawn over the picture: annotations, and a length that is measured. */
class Marks {
  notes = [];
  /** The ends of the measured length: none, one or two. */
  ends = [];

  constructor(root) {
    this.svg = root.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
    this.svg.setAttribute("class", "marks");
  }

  /** The measured length in world units; null before both ends are set. */
  get length() {
    return this.ends.length < 2 ? null : Math.hypot(...difference(...this.ends));
  }

  /** Draws all for a camera as in scene files. */
  draw(camera) {
    this.svg.replaceChildren();
    if (!camera) return;
    const places = this.ends.map((point) => this.place(camera, point));
    if (places.length === 2 && places.every(Boolean)) {
      const [[x1, y1], [x2, y2]] = places;
      this.add("line", { x1, y1, x2, y2 });
      const text = String(Number(this.length.toPrecision(4)));
      this.add("text", { x: (x1 + x2) / 2 + 6, y: (y1 + y2) / 2 - 6 }, text);
    }
    for (const place of places) this.dot(place);
    for (const { point, text } of this.notes) {
      const place = this.place(camera, point);
      this.dot(place);
      if (place) this.add("text", { x: place[0] + 8, y: place[1] + 4 }, text);
    }
  }

  dot(place) {
    if (place) this.add("circle", { cx: place[0], cy: place[1], r: 4 });
  }

  add(name, attributes, text = "") {
    const mark = this.svg.appendChild(document.createElementNS(this.svg.namespaceURI, name));
    for (const [key, value] of Object.entries(attributes)) mark.setAttribute(key, value);
    mark.textContent = text;
  }

  /** Returns where a point of the world is, in pixels of the page; nothing if it is behind. */
  place(camera, point) {
    const { clientWidth: width, clientHeight: height } = this.svg.parentNode.host;
    const forward = unit(difference(camera.focal_point, camera.position));
    const right = unit(cross(forward, camera.view_up));
    const way = difference(point, camera.position);
    const depth = product(way, forward);
    const isFlat = camera.height != null;
    if (!isFlat && depth <= 0) return null;
    const shown = isFlat ? camera.height : 2 * depth * Math.tan((camera.view_angle * Math.PI) / 360);
    const scale = height / shown;
    return [width / 2 + product(way, right) * scale, height / 2 - product(way, cross(right, forward)) * scale];
  }
}

export class SplatkitViewer extends HTMLElement {
  static observedAttributes = ["src", "camera", "transfer", "clips", "label", "pixel-ratio", "annotations"];

  #worker = null;
  /** Workers that draw along. */
  #helpers = [];
  #canvas;
  #marks;
  #pressed = null;
  #isMeasuring = false;
  #context;
  #status;
  #problem;
  #help;
  #observer;
  #pointers = new Map();
  #flying = new Set();
  #flightTime = 0;
  #questions = new Map();
  #camera = null;
  #cameraText = "";
  #transfers = [];
  #opening = 0;
  #isOpen = false;
  #isExact = false;
  #isFetching = false;
  #drawnBy;
  #wheel = null;
  #size = [0, 0];

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(STYLE);
    root.adoptedStyleSheets = [sheet];
    const make = (name, properties, parent = root) =>
      parent.appendChild(Object.assign(document.createElement(name), properties));
    this.#canvas = make("canvas", { tabIndex: 0, role: "img" });
    this.#canvas.setAttribute("part", "canvas");
    this.#context = this.#canvas.getContext("2d");
    this.#marks = new Marks(root);
    this.#status = make("div", { className: "panel status", role: "status", hidden: true });
    this.#problem = make("div", { className: "panel problem", role: "alert", hidden: true });
    const tools = make("div", { className: "tools" });
    tools.setAttribute("part", "tools");
    const button = (icon, label, act) => {
      const one = make("button", { title: label, onclick: act, innerHTML: icon }, tools);
      one.setAttribute("aria-label", label);
    };
    button(ICONS.whole, "The whole scene (Home)", () => this.fit());
    button(ICONS.ruler, "Measure between two clicks (M)", () => this.measure());
    button(ICONS.screen, "Full screen (F)", () => this.toggleFullscreen());
    button(ICONS.help, "Help (H)", () => this.#toggleHelp());
    this.#help = make("table", { className: "panel help", hidden: true });
    for (const [hand, does] of HELP) {
      const row = this.#help.insertRow();
      row.insertCell().textContent = hand;
      row.insertCell().textContent = does;
    }
    const row = this.#help.insertRow();
    row.insertCell().textContent = "drawn by";
    this.#drawnBy = row.insertCell();
    this.#listen();
  }

  connectedCallback() {
    this.#describe();
    this.#observer = new ResizeObserver(() => this.#resize());
    this.#observer.observe(this);
    if (this.src && !this.#isOpen) this.#openSource();
  }

  disconnectedCallback() {
    this.#observer?.disconnect();
    this.close();
  }

  attributeChangedCallback(name, before, after) {
    if (!this.isConnected || before === after) return;
    if (name === "src") this.#openSource();
    else if (name === "label") this.#describe();
    else if (name === "annotations") this.annotations = JSON.parse(after || "[]");
    else if (name === "pixel-ratio") this.#resize();
    else if (this.#isOpen) this.#applyAttribute(name);
  }

  #applyAttribute(name) {
    const text = this.getAttribute(name);
    if (text === null) return;
    if (name === "camera") this.#post({ type: "camera", camera: text });
    if (name === "transfer") this.#post({ type: "transfer", field: 0, transfer: text });
    if (name === "clips") this.#post({ type: "clips", clips: text });
  }

  /** The address of a scene file, or of a file of data. */
  get src() {
    return this.getAttribute("src") ?? "";
  }
  set src(address) {
    this.setAttribute("src", address);
  }

  /** The camera as in scene files; null before a scene is shown. */
  get camera() {
    return this.#camera && structuredClone(this.#camera);
  }
  set camera(camera) {
    this.#post({ type: "camera", camera: JSON.stringify(camera) });
  }

  /** The transfer functions of the fields, as they were loaded. */
  get transfers() {
    return structuredClone(this.#transfers);
  }

  /** Whether the exact picture is shown. */
  get isExact() {
    return this.#isExact;
  }

  setTransfer(transfer, field = 0) {
    this.#post({ type: "transfer", field, transfer: JSON.stringify(transfer) });
  }

  setClips(clips) {
    this.#post({ type: "clips", clips: JSON.stringify(clips) });
  }

  /** Texts at points of the world: `{ point: [x, y, z], text }`. */
  get annotations() {
    return structuredClone(this.#marks.notes);
  }
  set annotations(notes) {
    this.#marks.notes = structuredClone(notes);
    this.#marks.draw(this.#camera);
  }

  /** Begins to measure between two clicks, or ends it and removes what was measured. */
  measure(isMeasuring = !this.#isMeasuring) {
    this.#isMeasuring = isMeasuring;
    this.#canvas.classList.toggle("measuring", isMeasuring);
    this.#marks.ends = [];
    this.#marks.draw(this.#camera);
  }

  /** Takes a click as an end of the length that is measured. */
  async #measureAt(event) {
    const point = await this.pointAt(event.clientX, event.clientY);
    if (!point || !this.#isMeasuring) return;
    const ends = this.#marks.ends;
    this.#marks.ends = ends.length < 2 ? [...ends, point] : [point];
    this.#marks.draw(this.#camera);
    const { length } = this.#marks;
    if (length !== null) this.#tell("measure", { points: structuredClone(this.#marks.ends), length });
  }

  /** Shows the whole scene, from a side (“front”, “top” …) or as at first. */
  fit(side = "") {
    this.#post({ type: "fit", side });
  }

  toggleFullscreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.requestFullscreen?.().catch((error) => this.#complain(error.message));
  }

  /** The point of the scene at a place of the page, in world units; null where there is none. */
  pointAt(clientX, clientY) {
    const [x, y] = this.#pixel({ clientX, clientY });
    const id = crypto.randomUUID?.() ?? String(Math.random());
    return new Promise((answer) => {
      this.#questions.set(id, answer);
      this.#post({ type: "point", x, y, id });
    });
  }

  /** The picture as a file. */
  picture(type = "image/png") {
    return new Promise((answer) => this.#canvas.toBlob(answer, type));
  }

  /** The canvas, for programs that read its pixels. */
  get canvas() {
    return this.#canvas;
  }

  /** Shows a scene: its description as in scene files, and its files as [name, ArrayBuffer], or as
   *  [name, address] for hierarchies and bricks, which are read in parts. */
  async open(scene, files) {
    const opening = ++this.#opening;
    this.#endHelpers();
    this.#say("Loading…");
    this.#problem.hidden = true;
    try {
      const wasm = this.#worker ? null : await resources.wasm((bytes) => this.#say(`Loading the engine, ${megabytes(bytes)}`));
      if (opening !== this.#opening) return;
      if (!this.#worker) {
        this.#worker = await resources.worker();
        this.#worker.onmessage = ({ data }) => this.#hear(data);
        this.#worker.onerror = (event) =>
          this.#complain(event.message || "The worker that draws could not be started.", true);
      }
      const [width, height] = (this.#size = this.#wantedSize());
      const text = typeof scene === "string" ? scene : JSON.stringify(scene);
      const buffers = [...files].map(([name, file]) => [name, file instanceof ArrayBuffer ? file : new URL(file, document.baseURI).href]);
      const moved = buffers.map(([, file]) => file).filter((file) => file instanceof ArrayBuffer);
      if (wasm) moved.push(wasm);
      this.#worker.postMessage({ type: "open", wasm, scene: text, files: buffers, engine: this.getAttribute("engine") ?? "auto", width, height }, moved);
    } catch (error) {
      if (opening === this.#opening) this.#complain(error.message, true);
    }
  }

  /** Starts workers that draw along with the worker of the scene, which hears of each. */
  async #startHelpers({ count, opening }) {
    this.#endHelpers();
    const [worker, helpers] = [this.#worker, this.#helpers];
    try {
      for (let number = 0; number < count; number++) {
        const helper = await resources.worker();
        if (worker !== this.#worker || helpers !== this.#helpers) return helper.terminate();
        helpers.push(helper);
        const { port1, port2 } = new MessageChannel();
        // A helper that says nothing is not waited for.
        helper.onerror = (event) => event.preventDefault();
        helper.postMessage({ type: "help", port: port2 }, [port2]);
        worker.postMessage({ type: "helper", port: port1, opening }, [port1]);
      }
    } catch {
      // The scene's worker draws alone.
    }
  }

  #endHelpers() {
    for (const helper of this.#helpers) helper.terminate();
    this.#helpers = [];
  }

  /** Says in the page what went wrong, and ends the worker. */
  complain(message) {
    this.#complain(message, true);
  }

  /** Ends the worker and gives its memory back. */
  close() {
    this.#opening++;
    this.#worker?.terminate();
    this.#worker = null;
    this.#endHelpers();
    this.#isOpen = false;
    this.#isFetching = false;
  }

  async #openSource() {
    const opening = ++this.#opening;
    const address = new URL(this.src, document.baseURI);
    this.#problem.hidden = true;
    this.#say("Loading…");
    try {
      const name = decodeURIComponent(address.pathname.split("/").pop());
      const hear = (bytes, all) => this.#sayBytes(bytes, all);
      const taken = async (place) => (IN_PARTS.test(place.pathname) ? place.href : fetched(place, hear));
      const first = await taken(address);
      let scene = { splatkit_scene: 2, inputs: [{ file: name }] };
      const files = [];
      if (/\.json$/i.test(name)) {
        scene = JSON.parse(new TextDecoder().decode(first));
        const names = new Set(scene.inputs.filter((input) => input.visible !== false).map((input) => input.file));
        for (const file of names) {
          const place = new URL(file.split("/").map(encodeURIComponent).join("/"), address);
          if (opening !== this.#opening) return;
          files.push([file, await taken(place)]);
        }
      } else {
        files.push([name, first]);
      }
      if (opening === this.#opening) await this.open(scene, files);
    } catch (error) {
      if (opening === this.#opening) this.#complain(error.message, true);
    }
  }

  #sayBytes(bytes, all) {
    this.#say(all ? `Loading ${megabytes(bytes)} of ${megabytes(all)}` : `Loading ${megabytes(bytes)}`);
  }

  #post(message) {
    this.#worker?.postMessage(message);
  }

  #hear(message) {
    if (message.type === "frame") this.#show(message);
    if (message.type === "point") {
      this.#questions.get(message.id)?.(message.point.length ? message.point : null);
      this.#questions.delete(message.id);
    }
    if (message.type === "rest") this.#tell("rest");
    if (message.type === "helpers") this.#startHelpers(message);
    if (message.type === "fetched") this.#hearFetched(message);
    if (message.type === "transfers") this.#transfers = JSON.parse(message.transfers);
    if (message.type === "error") this.#complain(message.message, message.isFatal);
    if (message.type === "load") {
      this.#isOpen = true;
      this.#transfers = JSON.parse(message.transfers);
      this.#describe(message.summary);
      for (const name of ["camera", "transfer", "clips"]) this.#applyAttribute(name);
      this.#resize();
      const { summary, warnings, engine, reason } = message;
      this.#sayEngine(engine, reason);
      this.#tell("load", { summary, warnings, engine, reason });
    }
  }

  /** Parts of files have come. */
  #hearFetched({ requests, bytes, cancelled, isBusy }) {
    if (isBusy) this.#say(`Loading, ${megabytes(bytes)} so far`);
    else this.#status.hidden = true;
    this.#isFetching = isBusy;
    this.#tell("fetched", { requests, bytes, cancelled, isBusy });
  }

  #sayEngine(engine, reason) {
    this.#drawnBy.textContent = engine === "webgpu" ? "WebGPU" : `the processor. ${reason}`;
  }

  #show({ width, height, isExact, milliseconds, camera, buffer, engine, reason, workers }) {
    const pixels = new ImageData(new Uint8ClampedArray(buffer), width, height);
    const [wide, high] = this.#size;
    if (this.#canvas.width !== wide || this.#canvas.height !== high) {
      this.#canvas.width = wide;
      this.#canvas.height = high;
    }
    if (width === wide && height === high) {
      this.#context.putImageData(pixels, 0, 0);
    } else {
      this.#scaled(pixels);
    }
    this.#status.hidden = !this.#isFetching;
    this.#isExact = isExact;
    const isMoved = camera !== this.#cameraText;
    this.#cameraText = camera;
    this.#camera = JSON.parse(camera);
    this.#marks.draw(this.#camera);
    this.#sayEngine(engine, reason);
    this.#tell("frame", { width, height, isExact, milliseconds, engine, reason, workers });
    if (isMoved) this.#tell("camerachange", { camera: this.camera });
  }

  /** Draws a coarse frame over the whole canvas. */
  #scaled(pixels) {
    const small = new OffscreenCanvas(pixels.width, pixels.height);
    small.getContext("2d").putImageData(pixels, 0, 0);
    const { width, height } = this.#canvas;
    this.#context.clearRect(0, 0, width, height);
    this.#context.imageSmoothingEnabled = true;
    this.#context.drawImage(small, 0, 0, width, height);
  }

  #tell(name, detail = {}) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  #say(text) {
    this.#status.textContent = text;
    this.#status.hidden = false;
  }

  #complain(message, isFatal = false) {
    this.#status.hidden = true;
    this.#problem.textContent = message;
    this.#problem.hidden = false;
    if (!isFatal) setTimeout(() => (this.#problem.hidden = true), 8000);
    this.#tell("error", { message, isFatal });
    if (isFatal) this.close();
  }

  #describe(summary = "") {
    const label = this.getAttribute("label") ?? (summary ? `3D view of ${summary}` : "3D view");
    this.#canvas.setAttribute("aria-label", `${label}. Arrow keys turn it, plus and minus come closer.`);
  }

  #toggleHelp() {
    this.#help.hidden = !this.#help.hidden;
  }

  #wantedSize() {
    const ratio = Number(this.getAttribute("pixel-ratio")) || window.devicePixelRatio || 1;
    const sides = [this.clientWidth || 1, this.clientHeight || 1];
    const most = Math.sqrt(MOST_PIXELS / (sides[0] * sides[1]));
    return sides.map((side) => Math.max(1, Math.round(side * Math.min(ratio, most))));
  }

  #resize() {
    const size = this.#wantedSize();
    if (!this.#isOpen || (size[0] === this.#size[0] && size[1] === this.#size[1])) return;
    this.#size = size;
    this.#post({ type: "resize", width: size[0], height: size[1] });
  }

  /** The place of an event, in pixels of the picture. */
  #pixel({ clientX, clientY }) {
    const area = this.#canvas.getBoundingClientRect();
    return [
      ((clientX - area.left) * this.#size[0]) / (area.width || 1),
      ((clientY - area.top) * this.#size[1]) / (area.height || 1),
    ];
  }

  #listen() {
    const canvas = this.#canvas;
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    canvas.addEventListener("pointerup", (event) => {
      const { clientX, clientY } = this.#pressed ?? event;
      const isClick = Math.hypot(event.clientX - clientX, event.clientY - clientY) < 4;
      if (this.#isMeasuring && isClick) this.#measureAt(event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.#pointers.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.#roll(event), { passive: false });
    canvas.addEventListener("dblclick", (event) => {
      const [x, y] = this.#pixel(event);
      this.#post({ type: "center", x, y });
    });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => this.#flying.delete(event.key.toLowerCase()));
    canvas.addEventListener("blur", () => this.#flying.clear());
  }

  #press(event) {
    this.#pressed = event;
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, this.#pixel(event));
    const [x, y] = this.#middle();
    this.#post({ type: "grab", x, y });
  }

  #middle() {
    const all = [...this.#pointers.values()];
    return [0, 1].map((axis) => all.reduce((sum, at) => sum + at[axis], 0) / all.length);
  }

  #spread() {
    const [[ax, ay], [bx, by]] = [...this.#pointers.values()];
    return Math.max(Math.hypot(ax - bx, ay - by), 1);
  }

  #drag(event) {
    if (!this.#pointers.has(event.pointerId)) return;
    const isPinch = this.#pointers.size > 1;
    const [before, wide] = [this.#middle(), isPinch && this.#spread()];
    this.#pointers.set(event.pointerId, this.#pixel(event));
    const after = this.#middle();
    const [x, y] = [after[0] - before[0], after[1] - before[1]];
    const pans = isPinch || event.shiftKey || event.buttons & 6;
    const kind = pans ? "pan" : event.altKey ? "look" : "turn";
    if (x || y) this.#post({ type: "drag", kind, x, y });
    if (isPinch) {
      const factor = this.#spread() / wide;
      if (factor !== 1) this.#post({ type: "zoom", factor, x: after[0], y: after[1] });
    }
  }

  #roll(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    const [x, y] = this.#pixel(event);
    const step = Math.exp((-event.deltaY * lines) / 400);
    if (this.#wheel) {
      this.#wheel = { factor: this.#wheel.factor * step, x, y };
      return;
    }
    this.#wheel = { factor: step, x, y };
    requestAnimationFrame(() => {
      this.#post({ type: "zoom", ...this.#wheel });
      this.#wheel = null;
    });
  }

  #key(event) {
    const key = event.key.toLowerCase();
    const digit = /^Digit(\d)$/.exec(event.code)?.[1] ?? (/^\d$/.test(key) ? key : null);
    const step = this.#size[1] / 24;
    const arrows = { arrowleft: [-step, 0], arrowright: [step, 0], arrowup: [0, -step], arrowdown: [0, step] };
    const side = (event.ctrlKey ? OPPOSITES : SIDES)[digit];
    if (event.metaKey || event.altKey || (event.ctrlKey && !side)) return;
    if (arrows[key]) {
      const [x, y] = arrows[key];
      this.#post({ type: "drag", kind: event.shiftKey ? "pan" : "turn", x, y });
    } else if (key === "+" || key === "=" || key === "-") {
      const [x, y] = this.#size.map((length) => length / 2);
      this.#post({ type: "zoom", factor: key === "-" ? 1 / 1.2 : 1.2, x, y });
    } else if (side) this.fit(side);
    else if (key === "home") this.fit();
    else if (key === "o") this.#post({ type: "perspective" });
    else if (key === "m") this.measure();
    else if (key === "f") this.toggleFullscreen();
    else if (key === "h") this.#toggleHelp();
    else if (FLIES[key]) this.#fly(key);
    else return;
    event.preventDefault();
  }

  #fly(key) {
    if (this.#flying.has(key)) return;
    const isFirst = this.#flying.size === 0;
    this.#flying.add(key);
    if (!isFirst) return;
    this.#flightTime = performance.now();
    const step = (now) => {
      if (this.#flying.size === 0) return;
      const share = (SPEED * Math.min(now - this.#flightTime, 100)) / 1000;
      this.#flightTime = now;
      const sum = (axis) => [...this.#flying].reduce((all, one) => all + FLIES[one][axis], 0) * share;
      this.#post({ type: "fly", right: sum(0), up: sum(1), forward: sum(2) });
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

if (!customElements.get("splatkit-viewer")) customElements.define("splatkit-viewer", SplatkitViewer);
