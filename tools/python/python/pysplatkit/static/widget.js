// The widget: a picture of a scene that is turned by hand, and the editor of its transfer functions.
// A plain module, without dependencies.

/** Longest wait for an answer of the kernel, in milliseconds. */
const PATIENCE = 3000;
/** Most messages that wait for an answer of the kernel. */
const AHEAD = 2;
/** Most pixels of the screen in one of CSS that are drawn. */
const MOST_RATIO = 3;
/** The pause between parts of a page, in milliseconds: notebook servers take 1 MB a second. */
const PACE = 280;
/** A turn by an arrow key, as a share of the picture's height. */
const STEP = 1 / 36;
/** The drag that doubles the window, and the one that moves the level over all values, in pixels. */
const DOUBLE = 150;
const WHOLE = 600;
/** The least and the largest window, as shares of the range of values. */
const WINDOWS = [1e-5, 100];
/** The size of the opacity plot. */
const PLOT = { width: 280, height: 130 };
/** Room around it for the points at its border. */
const MARGIN = 6;

const HELP = `Drag to turn, right or Shift+drag to move, Ctrl+drag for level and window.
The wheel zooms once the picture has the focus. Double-click to turn about a point.
Keys: arrows turn, Shift+arrows move, + and − zoom, 1 3 7 front, right, top (with Shift: back,
left, bottom), 0 corner, Home whole scene, O perspective.`;

/** Entries of lists that are no names: nothing, and the function that a field came with. */
const CHOOSE = "…";
const LOADED = "as loaded";

const SIDES = { Digit1: ["front", "back"], Digit3: ["right", "left"], Digit7: ["top", "bottom"] };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function make(tag, properties = {}, ...children) {
  const { role, ...rest } = properties;
  const element = Object.assign(document.createElement(tag), rest);
  if (role) element.setAttribute("role", role);
  element.append(...children);
  return element;
}

function draw(tag, attributes = {}) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const plain = (value) => String(Number(value.toPrecision(4)));

/** Writes a value of a range without digits that are far below the range's width. */
function ofRange(value, [low, high]) {
  const unit = 10 ** Math.floor(Math.log10(high - low) - 3);
  return plain(Math.round(value / unit) * unit);
}

/**
 * Sends what the hand does. Two messages may wait for an answer: while the kernel draws the first
 * view, the second is there already. Further gestures are joined, so that no queue builds up.
 */
class Hand {
  constructor(model, onIdle, onLate) {
    this.model = model;
    this.onIdle = onIdle;
    this.onLate = onLate;
    this.view = Math.random().toString(36).slice(2);
    this.waiting = [];
    this.timer = null;
    /** The numbers of the last message that was sent, and of the last that was answered. */
    this.sent = 0;
    this.answeredTo = 0;
  }

  get isIdle() {
    return this.sent === this.answeredTo && this.waiting.length === 0;
  }

  do(kind, details = {}) {
    const last = this.waiting.at(-1);
    // Two toggles are not one, and fields are edited apart.
    const joins = kind !== "projection" && last?.[1].field === details.field;
    if (joins && last?.[0] === kind) {
      const [, before] = last;
      last[1] = {
        ...details,
        ...(details.drag && { drag: details.drag.map((side, axis) => side + before.drag[axis]) }),
        ...(details.factor && { factor: details.factor * before.factor }),
      };
    } else {
      this.waiting.push([kind, details]);
    }
    this.flush();
  }

  flush() {
    if (this.sent - this.answeredTo >= AHEAD || this.waiting.length === 0) return;
    this.sent += 1;
    this.model.send({ do: this.waiting, view: this.view, number: this.sent });
    this.waiting = [];
    this.wait();
  }

  /** Waits for an answer, but not for ever. */
  wait() {
    clearTimeout(this.timer);
    this.timer = null;
    if (this.sent === this.answeredTo) return;
    this.timer = setTimeout(() => {
      this.onLate();
      this.answered({ [this.view]: this.sent });
    }, PATIENCE);
  }

  /** The kernel has answered the messages of views up to these numbers. */
  answered(numbers = {}) {
    this.answeredTo = Math.max(this.answeredTo, numbers[this.view] ?? 0);
    this.wait();
    this.flush();
    if (this.isIdle) this.onIdle();
  }

  stop() {
    clearTimeout(this.timer);
  }
}

/** The picture, and the hand that turns it. */
class View {
  constructor(model, hand, moveWindow) {
    this.model = model;
    this.hand = hand;
    this.moveWindow = moveWindow;
    this.number = 0;
    this.drawnNumber = 0;
    this.canvas = make("canvas", { tabIndex: 0, role: "img", title: HELP });
    this.canvas.setAttribute("aria-label", `Picture of a scene. ${HELP}`);
    this.status = make("span", { className: "splatkit-status", textContent: "Drawing …" });
    this.error = make("div", { className: "splatkit-error", role: "alert", hidden: true });
    this.frame = make("div", { className: "splatkit-picture" }, this.canvas, this.error);
    this.root = make("div", { className: "splatkit-left" }, this.frame);
    this.resize();
    this.listen();
  }

  /** Pixels of the exact picture in one of the screen. */
  get ratio() {
    return clamp(window.devicePixelRatio || 1, 1, MOST_RATIO);
  }

  /** Pixels of the exact picture in one of CSS, as it is shown. */
  get scale() {
    const width = this.canvas.getBoundingClientRect().width || 1;
    return Math.round(this.model.get("size")[0] * this.ratio) / width;
  }

  resize() {
    const [width, height] = this.model.get("size");
    this.root.style.setProperty("--width", width);
    this.root.style.setProperty("--height", height);
  }

  /** Returns where the pointer is, in pixels of the exact picture. */
  cursor(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top].map((side) => side * this.scale);
  }

  listen() {
    const on = (name, listener) => this.canvas.addEventListener(name, listener, { passive: false });
    let drag = null;
    on("pointerdown", (event) => {
      this.canvas.focus({ preventScroll: true });
      this.canvas.setPointerCapture(event.pointerId);
      drag = { kind: this.kindOf(event), x: event.clientX, y: event.clientY };
      if (drag.kind === "pan") this.hand.do("grab", { cursor: this.cursor(event) });
      event.preventDefault();
    });
    on("pointermove", (event) => {
      if (!drag) return;
      const moved = [event.clientX - drag.x, event.clientY - drag.y];
      [drag.x, drag.y] = [event.clientX, event.clientY];
      if (!moved[0] && !moved[1]) return;
      if (drag.kind === "window") this.moveWindow(moved[0] / DOUBLE, -moved[1] / WHOLE);
      else this.hand.do(drag.kind, { drag: moved.map((side) => side * this.scale) });
    });
    for (const end of ["pointerup", "pointercancel"]) on(end, () => (drag = null));
    on("contextmenu", (event) => event.preventDefault());
    on("dblclick", (event) => this.hand.do("center", { cursor: this.cursor(event) }));
    on("wheel", (event) => {
      // Elsewhere the wheel scrolls the notebook. Pinches come with Ctrl.
      if (!event.ctrlKey && !this.canvas.matches(":focus")) return;
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      const speed = event.ctrlKey ? 100 : 400;
      const factor = Math.exp((-event.deltaY * lines) / speed);
      this.hand.do("zoom", { factor, cursor: this.cursor(event) });
    });
    on("keydown", (event) => {
      if (!this.press(event)) return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  kindOf(event) {
    if (event.button !== 0 || event.shiftKey) return "pan";
    if (event.ctrlKey || event.metaKey) return "window";
    return event.altKey ? "look_around" : "turn";
  }

  /** Answers a key. Returns whether it means something. */
  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const [width, height] = this.model.get("size").map((side) => side * this.ratio);
    const middle = [width / 2, height / 2];
    const arrow = ARROWS[event.key];
    const sides = SIDES[event.code];
    if (arrow) {
      const drag = arrow.map((side) => side * height * STEP);
      if (event.shiftKey) this.hand.do("grab", { cursor: middle });
      this.hand.do(event.shiftKey ? "pan" : "turn", { drag });
    } else if (event.key === "+" || event.key === "=") {
      this.hand.do("zoom", { factor: 1.25, cursor: middle });
    } else if (event.key === "-") {
      this.hand.do("zoom", { factor: 0.8, cursor: middle });
    } else if (sides) {
      this.hand.do("view", { name: sides[Number(event.shiftKey)] });
    } else if (event.code === "Digit0") {
      this.hand.do("view", { name: "iso" });
    } else if (event.key === "Home") {
      this.hand.do("view");
    } else if (event.key.toLowerCase() === "o") {
      this.hand.do("projection");
    } else {
      return false;
    }
    return true;
  }

  async show(png, status) {
    const number = ++this.number;
    const bitmap = await createImageBitmap(new Blob([png], { type: "image/png" }));
    // A picture that took longer to decode than the next one is dropped.
    if (number > this.drawnNumber) {
      this.drawnNumber = number;
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
      this.canvas.getContext("2d").drawImage(bitmap, 0, 0);
      this.tell(status);
    }
    bitmap.close();
  }

  tell({ size, exact, milliseconds }) {
    const [width, height] = size;
    const time = milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${plain(milliseconds / 1000)} s`;
    const text = `${width} × ${height} · ${time} · ${exact ? "exact" : "refining …"}`;
    this.status.textContent = text;
    this.frame.dataset.shown = exact ? "exact" : "coarse";
  }

  fail(message) {
    this.error.textContent = message;
    this.error.hidden = !message;
  }
}

/**
 * The page of the scene, which draws in the browser. Its parts come one by one, slowly enough that
 * notebook servers let them pass. Until it draws, and if it cannot, the kernel's pictures are shown.
 */
class Page {
  constructor(model, hand, view) {
    this.model = model;
    this.hand = hand;
    this.view = view;
    this.clear();
  }

  clear() {
    clearTimeout(this.timer);
    this.frame?.remove();
    if (this.url) URL.revokeObjectURL(this.url);
    [this.frame, this.url, this.viewer, this.timer] = [null, null, null, null];
    this.parts = [];
    this.view.canvas.hidden = false;
  }

  /** Asks for the page. */
  ask() {
    if (this.model.get("_has_page")) this.hand.do("page", { number: this.parts.length });
  }

  /** Takes a part. */
  take({ number, count }, buffer) {
    if (number !== this.parts.length || this.frame) return;
    this.parts.push(buffer);
    if (this.parts.length === count) this.open();
    else this.timer = setTimeout(() => this.ask(), PACE);
  }

  open() {
    this.url = URL.createObjectURL(new Blob(this.parts, { type: "text/html" }));
    this.frame = make("iframe", { className: "splatkit-page", title: "Picture of a scene", src: this.url });
    this.frame.hidden = true;
    this.frame.addEventListener("load", () => {
      // Some hosts let no frame be looked into: the kernel goes on.
      this.viewer = this.frame?.contentDocument?.querySelector("splatkit-viewer");
      if (this.viewer) this.listen();
    });
    this.view.frame.append(this.frame);
  }

  listen() {
    const on = (name, listener) => this.viewer.addEventListener(name, listener);
    on("frame", ({ detail }) => {
      if (this.frame.hidden) this.begin();
      const size = [detail.width, detail.height];
      this.view.tell({ size, exact: detail.isExact, milliseconds: detail.milliseconds });
      this.view.status.textContent += " · browser";
    });
    on("camerachange", ({ detail }) => this.hand.do("camera", { camera: detail.camera }));
    on("error", ({ detail }) => {
      if (!detail.isFatal) return;
      this.clear();
      this.hand.do("local", { is_local: false });
    });
  }

  /** Draws from now on. */
  begin() {
    this.frame.hidden = false;
    this.view.canvas.hidden = true;
    this.hand.do("local", { is_local: true });
    this.setTransfers();
  }

  /** Takes the functions that the kernel has. */
  setTransfers() {
    this.model.get("_transfers").forEach((transfer, field) => this.viewer?.setTransfer(transfer, field));
  }
}

/** The editor of a transfer function: opacities by value, over the histogram. */
class Editor {
  constructor(model, hand) {
    this.model = model;
    this.hand = hand;
    this.selected = 0;
    this.drag = null;
    const box = [-MARGIN, -MARGIN, PLOT.width + 2 * MARGIN, PLOT.height + 2 * MARGIN];
    this.svg = draw("svg", { viewBox: box.join(" "), class: "splatkit-plot" });
    this.back = draw("rect", { ...PLOT, class: "splatkit-back" });
    this.bars = draw("path", { class: "splatkit-bars" });
    this.line = draw("polyline", { class: "splatkit-line" });
    this.points = draw("g");
    this.svg.append(this.back, ...this.grid(), this.bars, this.line, this.points);
    this.colors = make("div", { className: "splatkit-colors" });
    this.ends = make("div", { className: "splatkit-ends" });
    this.field = this.choice("Field", (name, index) => this.choose(index));
    this.preset = this.choice("Preset", (name) =>
      this.send("preset", { name: name === LOADED ? "" : name }),
    );
    this.map = this.choice("Colours", (name) => this.send("colors", { name }));
    this.value = this.number("Value", (value) => this.movePoint(value, null));
    this.opacity = this.number("Opacity", (opacity) => this.movePoint(null, opacity));
    this.level = this.slider("Level", () => this.window());
    this.width = this.slider("Window", () => this.window());
    const row = (...children) => make("div", { className: "splatkit-row" }, ...children);
    this.root = make(
      "section",
      { className: "splatkit-editor", ariaLabel: "Transfer function" },
      make("strong", { textContent: "Transfer function" }),
      this.field.label,
      this.svg,
      this.colors,
      this.ends,
      row(this.value.label, this.opacity.label),
      this.level.label,
      this.width.label,
      row(this.preset.label, this.map.label),
    );
    this.listen();
    this.sync();
  }

  grid() {
    return [0.01, 0.1, 0.5].flatMap((opacity) => {
      const y = this.y(opacity);
      const line = draw("line", { x1: 0, x2: PLOT.width, y1: y, y2: y, class: "splatkit-grid" });
      const text = draw("text", { x: 3, y: y - 2, class: "splatkit-grid" });
      text.textContent = opacity;
      return [line, text];
    });
  }

  label(name, ...controls) {
    return make("label", {}, make("span", { textContent: name }), ...controls);
  }

  choice(name, onChange) {
    const select = make("select");
    select.addEventListener("change", () => onChange(select.value, select.selectedIndex));
    return { select, label: this.label(name, select) };
  }

  number(name, onChange) {
    const input = make("input", { type: "number", step: "any" });
    input.addEventListener("change", () => onChange(Number(input.value)));
    return { input, label: this.label(name, input) };
  }

  slider(name, onChange) {
    const input = make("input", { type: "range", min: 0, max: 1, step: 0.001 });
    const output = make("output");
    input.addEventListener("input", onChange);
    return { input, output, label: this.label(name, input, output) };
  }

  // Numbers of the plot. Small opacities, which decide over the depth that is seen, have room.

  x(value) {
    const [low, high] = this.range;
    return ((value - low) / (high - low)) * PLOT.width;
  }

  y(opacity) {
    return PLOT.height * (1 - Math.sqrt(opacity));
  }

  at(event) {
    const box = this.back.getBoundingClientRect();
    const [low, high] = this.range;
    const share = clamp((event.clientX - box.left) / box.width, 0, 1);
    const height = clamp((box.bottom - event.clientY) / box.height, 0, 1);
    return [low + (high - low) * share, height * height];
  }

  /** Takes the function that the kernel has. */
  sync() {
    const transfers = this.model.get("_transfers");
    this.root.hidden = transfers.length === 0;
    if (this.root.hidden || this.drag) return;
    this.index = clamp(this.model.get("field"), 0, transfers.length - 1);
    this.transfer = structuredClone(transfers[this.index]);
    this.values = this.model.get("_ranges")[this.index];
    this.range = this.shownRange();
    this.selected = clamp(this.selected, 0, this.transfer.opacity.length - 1);
    this.fill(this.field.select, this.model.get("_names"), this.index);
    this.field.label.hidden = transfers.length < 2;
    this.fill(this.preset.select, [CHOOSE, LOADED, ...this.model.get("_presets")], 0);
    this.fill(this.map.select, [CHOOSE, ...this.model.get("_maps")], 0);
    this.drawHistogram();
    this.redraw();
  }

  /** The values, and the points beyond them as far as there is room. */
  shownRange() {
    let [low, high] = this.values;
    if (!(high > low)) [low, high] = [low - 0.5, low + 0.5];
    const points = this.transfer.opacity.map(([value]) => value);
    const width = high - low;
    return [
      Math.max(Math.min(low, ...points), low - width),
      Math.min(Math.max(high, ...points), high + width),
    ];
  }

  fill(select, names, index) {
    if (select.options.length !== names.length) {
      select.replaceChildren(...names.map((name) => make("option", { textContent: name })));
    }
    select.selectedIndex = index;
  }

  drawHistogram() {
    const counts = this.model.get("_histograms")[this.index] ?? [];
    const most = Math.log1p(Math.max(1, ...counts));
    const [left, right] = this.values.map((value) => this.x(value));
    const width = (right - left) / Math.max(1, counts.length);
    const bars = counts.map((count, at) => {
      const height = (Math.log1p(count) / most) * PLOT.height;
      return `M${left + at * width} ${PLOT.height}v${-height}h${width}v${height}z`;
    });
    this.bars.setAttribute("d", bars.join(""));
  }

  redraw() {
    const points = this.transfer.opacity;
    const first = points[0];
    const last = points[points.length - 1];
    // Beyond its points, the function keeps its opacity.
    const whole = [[this.range[0], first[1]], ...points, [this.range[1], last[1]]];
    const inside = ([value], at) => (at === 0 ? value <= first[0] : at <= points.length || value >= last[0]);
    const line = whole.filter(inside).map(([value, opacity]) => `${this.x(value)},${this.y(opacity)}`);
    this.line.setAttribute("points", line.join(" "));
    while (this.points.childElementCount > points.length) this.points.lastChild.remove();
    while (this.points.childElementCount < points.length) {
      const number = this.points.childElementCount;
      const circle = draw("circle", { r: 5, tabindex: 0, role: "slider", "data-number": number });
      circle.setAttribute("aria-label", `Opacity point ${number + 1}`);
      this.points.append(circle);
    }
    points.forEach(([value, opacity], number) => {
      const circle = this.points.children[number];
      circle.setAttribute("cx", this.x(value));
      circle.setAttribute("cy", this.y(opacity));
      circle.setAttribute("aria-valuenow", opacity);
      circle.setAttribute("aria-valuetext", `value ${ofRange(value, this.range)}, opacity ${plain(opacity)}`);
      circle.classList.toggle("splatkit-selected", number === this.selected);
      circle.toggleAttribute("hidden", value < this.range[0] || value > this.range[1]);
    });
    const [value, opacity] = points[this.selected];
    this.value.input.value = ofRange(value, this.range);
    this.opacity.input.value = plain(opacity);
    this.drawColors();
    this.drawWindow();
  }

  drawColors() {
    const share = (value) => (100 * this.x(value)) / PLOT.width;
    const stop = ([value, ...color]) =>
      `rgb(${color.map((part) => 255 * part).join(" ")}) ${share(value)}%`;
    const stops = this.transfer.color.map(stop);
    this.colors.style.background = `linear-gradient(to right, ${stops[0]}, ${stops.join(", ")})`;
    const ends = this.range.map((end) => make("span", { textContent: ofRange(end, this.range) }));
    this.ends.replaceChildren(...ends);
  }

  /** The lowest and the highest value of a point. */
  span() {
    const values = [...this.transfer.color, ...this.transfer.opacity].map((point) => point[0]);
    return [Math.min(...values), Math.max(...values)];
  }

  drawWindow() {
    const [low, high] = this.span();
    const [start, end] = this.range;
    const width = (high - low) / (end - start);
    this.level.input.value = ((low + high) / 2 - start) / (end - start);
    this.level.output.textContent = ofRange((low + high) / 2, this.range);
    // Doubling is the same step everywhere; all values are at three quarters.
    this.width.input.value = 0.75 + Math.log2(Math.max(width, WINDOWS[0])) / 16;
    this.width.output.textContent = ofRange(high - low, this.range);
    this.width.input.disabled = !(high > low);
  }

  window() {
    const [start, end] = this.range;
    const middle = start + (end - start) * Number(this.level.input.value);
    this.spread(middle, (end - start) * 2 ** (16 * (Number(this.width.input.value) - 0.75)));
  }

  /** Doubles the window `wider` times, and moves the level by a share of all values. */
  moveWindow(wider, higher) {
    if (!this.transfer) return;
    const [low, high] = this.span();
    const whole = this.range[1] - this.range[0];
    this.spread((low + high) / 2 + whole * higher, (high - low) * 2 ** wider);
  }

  /** Spreads the function around a value. */
  spread(middle, width) {
    const [low, high] = this.span();
    const whole = this.range[1] - this.range[0];
    const factor = high > low ? clamp(width, WINDOWS[0] * whole, WINDOWS[1] * whole) / (high - low) : 1;
    const move = (value) => middle + (value - (low + high) / 2) * factor;
    const { color, opacity, isosurfaces } = this.transfer;
    for (const point of [...color, ...opacity]) point[0] = move(point[0]);
    for (const surface of isosurfaces ?? []) surface.value = move(surface.value);
    this.changed();
  }

  changed() {
    this.redraw();
    this.send("transfer", { transfer: structuredClone(this.transfer) });
  }

  send(kind, details) {
    if (details.name === CHOOSE) return;
    this.hand.do(kind, { field: this.index, ...details });
  }

  choose(index) {
    this.selected = 0;
    this.model.set("field", index);
    this.model.save_changes();
    this.sync();
  }

  listen() {
    const on = (name, listener) => this.svg.addEventListener(name, listener);
    const numberOf = (event) => event.target.closest?.("circle")?.dataset.number;
    on("pointerdown", (event) => {
      const number = numberOf(event);
      if (number === undefined || event.button !== 0) return;
      this.select(Number(number));
      this.svg.setPointerCapture(event.pointerId);
      this.drag = true;
      event.preventDefault();
    });
    on("pointermove", (event) => {
      if (this.drag) this.movePoint(...this.at(event));
    });
    for (const end of ["pointerup", "pointercancel"]) on(end, () => (this.drag = null));
    on("dblclick", (event) => {
      if (numberOf(event) === undefined) this.addPoint(this.at(event));
    });
    on("contextmenu", (event) => {
      event.preventDefault();
      const number = numberOf(event);
      if (number !== undefined) this.removePoint(Number(number));
    });
    on("focusin", (event) => this.select(Number(numberOf(event) ?? this.selected)));
    on("keydown", (event) => {
      const arrow = ARROWS[event.key];
      const number = numberOf(event);
      if (number === undefined) return;
      if (arrow) this.step(arrow, event.shiftKey ? 10 : 1);
      else if (event.key === "Delete" || event.key === "Backspace") this.removePoint(Number(number));
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
    this.svg.append(draw("title"));
    this.svg.lastChild.textContent =
      "Drag points; double-click to add one, right-click or Delete to remove one.";
  }

  select(number) {
    this.selected = number;
    this.points.children[number]?.focus({ preventScroll: true });
    this.redraw();
  }

  step([right, down], factor) {
    const [value, opacity] = this.transfer.opacity[this.selected];
    const height = clamp(Math.sqrt(opacity) - 0.01 * down * factor, 0, 1);
    const step = (this.range[1] - this.range[0]) / PLOT.width;
    this.movePoint(value + right * step * factor, height * height);
  }

  /** Moves the chosen point, at most to its neighbours. Null keeps a number. */
  movePoint(value, opacity) {
    const points = this.transfer.opacity;
    const point = points[this.selected];
    const low = points[this.selected - 1]?.[0] ?? -Infinity;
    const high = points[this.selected + 1]?.[0] ?? Infinity;
    if (Number.isFinite(value ?? NaN)) point[0] = clamp(value, low, high);
    if (Number.isFinite(opacity ?? NaN)) point[1] = clamp(opacity, 0, 1);
    this.changed();
  }

  addPoint(point) {
    const points = this.transfer.opacity;
    const next = points.findIndex(([value]) => value > point[0]);
    const number = next < 0 ? points.length : next;
    points.splice(number, 0, point);
    this.changed();
    this.select(number);
  }

  removePoint(number) {
    if (this.transfer.opacity.length < 2) return;
    this.transfer.opacity.splice(number, 1);
    this.selected = Math.max(0, number - 1);
    this.changed();
  }
}

function buttons(model, hand, page) {
  const button = (text, title, onClick) => {
    const element = make("button", { type: "button", textContent: text, title });
    element.addEventListener("click", onClick);
    return element;
  };
  const side = (name, text, title) => button(text, title, () => hand.do("view", { name }));
  const save = async () => {
    const still = model.get("_still");
    const png = page.viewer
      ? await page.viewer.picture("image/png")
      : still?.byteLength && new Blob([still], { type: "image/png" });
    if (!png) return;
    const href = URL.createObjectURL(png);
    make("a", { href, download: "picture.png" }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  };
  return [
    button("Fit", "The whole scene (Home)", () => hand.do("view")),
    side("front", "Front", "From the front (1)"),
    side("right", "Right", "From the right (3)"),
    side("top", "Top", "From above (7)"),
    button("Perspective", "Perspective on and off (O)", () => hand.do("projection")),
    button("Save", "Save the exact picture as PNG", save),
  ];
}

function render({ model, el }) {
  const late = () => (view.status.textContent = "Waiting for the kernel …");
  const hand = new Hand(model, () => editor.sync(), late);
  const view = new View(model, hand, (wider, higher) => editor.moveWindow(wider, higher));
  const editor = new Editor(model, hand);
  const page = new Page(model, hand, view);
  const tools = make("div", { className: "splatkit-tools" }, ...buttons(model, hand, page));
  const bar = make("div", { className: "splatkit-bar" }, view.status, tools);
  view.root.append(bar);
  const root = make("div", { className: "splatkit" }, view.root, editor.root);
  // Keys are for the widget alone, not for JupyterLab's commands.
  root.dataset.lmSuppressShortcuts = "true";
  root.addEventListener("keydown", (event) => event.stopPropagation());
  el.append(root);

  const listeners = [];
  const on = (name, listener) => {
    model.on(name, listener);
    listeners.push([name, listener]);
  };
  const showStill = () => {
    const png = model.get("_still");
    if (!png?.byteLength) return;
    view.show(png, model.get("_status"));
    hand.answered(model.get("_status").answers);
  };
  on("msg:custom", (message, buffers) => {
    if (message.type === "frame" && !page.viewer) view.show(buffers[0], message);
    if (message.type === "page") page.take(message, buffers[0]);
    if (message.type === "camera" && page.viewer) page.viewer.camera = message.camera;
    if (message.type === "stale") {
      page.clear();
      page.ask();
    }
    hand.answered(message.answers);
  });
  on("change:_still", showStill);
  on("change:_error", () => view.fail(model.get("_error")));
  on("change:size", () => view.resize());
  on("change:_histograms", () => editor.sync());
  on("change:field", () => editor.sync());
  // What comes back of the hand's own changes may be older than they are.
  on("change:_transfers", () => {
    if (hand.isIdle) editor.sync();
    page.setTransfers();
  });
  view.fail(model.get("_error"));
  showStill();
  // The ratio changes with the screen and with the zoom of the page.
  let ratio = null;
  const measure = () => {
    if (ratio === view.ratio) return;
    ratio = view.ratio;
    hand.do("ready", { ratio });
  };
  measure();
  page.ask();
  window.addEventListener("resize", measure);

  return () => {
    hand.stop();
    page.clear();
    window.removeEventListener("resize", measure);
    for (const [name, listener] of listeners) model.off(name, listener);
  };
}

export default { render };
