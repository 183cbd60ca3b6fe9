// The worker that holds the engine: it hears the page, and draws strip by strip between messages.
//
// tools/web/build puts this behind the glue of wasm-bindgen, whose `initSync`, `Engine`, `Files` and
// `Viewer` it uses, and behind ranges.js.

let viewer = null;
/** The GPU engine, once it was asked for. All scenes share its device, until that is lost. */
let webgpu = null;
/** What draws: its name, and why it is not WebGPU. */
let drawn = { engine: "cpu", reason: "" };
/** The viewer whose GPU is listened to. */
let listening = null;
/** What fetches files in parts. */
let ranges = null;
/** Counts the scenes that were opened. */
let opening = 0;
/** Whether the page knows that the view needs more than may be held. */
let isFull = false;
/** Whether the scene was read before all was there that it depends on. */
let isRough = false;
let isScheduled = false;
/** Whether the page knows that nothing moves. */
let isResting = true;
/** Pointers move more often than frames are drawn: drags are summed up until the next one. */
let drags = new Map();
/** The engine, compiled, and what it holds in memory. */
let compiled = null;
let memory = null;
/** What the scene was opened with: its text, its files and the size of its picture. */
let opened = null;
/** What draws bands of the frames beside this worker. */
let helpers = null;
const pulse = new MessageChannel();
pulse.port1.onmessage = () => {
  isScheduled = false;
  work();
};

function schedule(milliseconds = 0) {
  if (isScheduled) return;
  isScheduled = true;
  if (milliseconds > 0) setTimeout(() => pulse.port2.postMessage(0), milliseconds);
  else pulse.port2.postMessage(0);
}

/** Says what went wrong, in words. A trap of the engine leaves it unusable. */
function complain(error) {
  const isTrap = error instanceof WebAssembly.RuntimeError;
  const text = isTrap
    ? "The engine stopped: the scene may need more memory than a page can have. Reload the page to try again."
    : String(error?.message ?? error);
  if (isTrap) {
    viewer = null;
    ranges?.close();
    helpers?.close();
  }
  postMessage({ type: "error", message: text, isFatal: isTrap || !viewer });
}

/** Waits for the GPU, and goes on then. */
function listen() {
  if (listening === viewer) return;
  const mine = (listening = viewer);
  mine.more().then(() => {
    if (listening === mine) listening = null;
    schedule();
  });
}

/** Goes on without WebGPU. The next scene asks for it again. */
function goOn() {
  webgpu = null;
  drawn = { engine: "cpu", reason: viewer.refusal() };
}

/** Hears whether WebGPU still draws. If it gave up, the page is told why. */
function hearEngine() {
  if (drawn.engine === "cpu" || viewer.is_gpu()) return;
  goOn();
  hint(`The processor draws from now on, because WebGPU failed: ${drawn.reason}`);
}

/** The most helpers, and the most bytes of their memory, as far as is known. */
const MOST_HELPERS = 4;
const HELPERS_BYTES = 256 * 2 ** 20;
/** The bytes for helpers for each GiB of the machine. */
const SHARE = 64 * 2 ** 20;
/** The milliseconds that a band may take at most. */
const LONG = 20_000;

/** Returns how many helpers may draw along, if each takes as much memory as this worker. */
function wantedHelpers() {
  const most = Math.min(HELPERS_BYTES, (navigator.deviceMemory ?? Infinity) * SHARE);
  const cores = (navigator.hardwareConcurrency ?? 1) - 1;
  return Math.max(0, Math.min(MOST_HELPERS, cores, Math.floor(most / memory.buffer.byteLength)));
}

/** Other workers with the same scene, which draw bands of its frames. The page starts them. */
class Helpers {
  /** Each has a port, and what it draws: the numbers of the frame and of the band. */
  #all = [];
  #timer = null;
  isClosed = false;

  constructor() {
    const count = wantedHelpers();
    if (count > 0) postMessage({ type: "helpers", count, opening });
  }

  /** A helper has come. It opens the scene. */
  add(port) {
    const one = { port, isReady: false, draws: null };
    this.#all.push(one);
    port.onmessage = ({ data }) => {
      if (this.#all.includes(one)) this.#hear(one, data);
    };
    const { scene, held, width, height } = opened;
    const files = held.names().map((name) => [name, held.bytes(name).buffer]);
    port.postMessage({ module: compiled, scene, files, width, height }, files.map(([, buffer]) => buffer));
  }

  #hear(one, { failed, frame, band, numbers }) {
    try {
      if (failed) return this.#drop(one);
      one.isReady = true;
      one.draws = null;
      if (numbers) viewer.give_back(frame, band, numbers);
      else viewer.set_helpers(this.count);
      this.lend();
      schedule();
    } catch (error) {
      complain(error);
    }
  }

  /** How many draw along. */
  get count() {
    return this.#all.filter(({ isReady }) => isReady).length;
  }

  /** Gives bands of the frame to those that draw nothing. */
  lend() {
    for (const one of this.#all) {
      if (!one.isReady || one.draws) continue;
      const job = viewer.lend();
      if (!job) break;
      const { frame, band } = JSON.parse(job);
      one.draws = { frame, band, since: performance.now() };
      one.port.postMessage({ job });
    }
  }

  /** Waits for a helper, but not for ever. */
  watch() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      if (!viewer || this.isClosed) return;
      const late = this.#all.filter(({ draws }) => draws && performance.now() - draws.since >= LONG);
      for (const one of late) this.#drop(one);
      schedule();
    }, LONG + 100);
  }

  /** Goes on without a helper: others draw what it was to draw. */
  #drop(one) {
    this.#all.splice(this.#all.indexOf(one), 1);
    one.port.close();
    viewer.set_helpers(this.count);
    if (one.draws) viewer.take_back(one.draws.frame, one.draws.band);
    schedule();
  }

  /** All helpers have failed, or are no longer needed. */
  close() {
    this.isClosed = true;
    clearTimeout(this.#timer);
    for (const { port } of this.#all) port.close();
    this.#all = [];
  }
}

/** Draws bands for another worker. */
function help(port) {
  const say = (message, moved = []) => port.postMessage(message, moved);
  port.onmessage = ({ data }) => {
    try {
      if (data.module) {
        initSync({ module: data.module });
        const held = new Files();
        if (navigator.deviceMemory) held.set_machine(navigator.deviceMemory);
        for (const [name, file] of data.files) held.add(name, new Uint8Array(file));
        viewer = new Viewer(data.scene, held, Engine.cpu(), data.width, data.height);
        say({});
        return;
      }
      const { frame, band } = JSON.parse(data.job);
      const numbers = viewer.help(data.job);
      say({ frame, band, numbers }, [numbers.buffer]);
    } catch {
      say({ failed: true });
      close();
    }
  };
}

function applyDrags() {
  for (const [name, [x, y]] of drags) viewer[name](x, y);
  drags.clear();
}

function work() {
  if (!viewer) return;
  try {
    applyDrags();
    const wait = viewer.step();
    hearEngine();
    helpers?.lend();
    if (wait === -1) {
      if (!isResting) postMessage({ type: "rest" });
      isResting = true;
      return;
    }
    isResting = false;
    if (wait === -2) showFrame();
    if (wait === -2) sayFull();
    if (wait === -2 || wait === -3) fetchMore();
    if (wait === -4) listen();
    if (wait === -5) helpers.watch();
    if (wait === -2 && !helpers && !ranges && drawn.engine === "cpu") helpers = new Helpers();
    if (isRough && !viewer.is_rough()) {
      isRough = false;
      postMessage({ type: "transfers", transfers: viewer.transfers() });
    }
    // At −3, what comes wakes this, at −4 the GPU, and at −5 a helper.
    if (wait > -3) schedule(Math.max(wait, 0));
  } catch (error) {
    complain(error);
  }
}

function showFrame() {
  const [width, height, exact, milliseconds] = viewer.frame();
  const { buffer } = viewer.pixels();
  const camera = viewer.camera();
  postMessage(
    { type: "frame", width, height, isExact: exact === 1, milliseconds, camera, buffer, workers: 1 + (helpers?.count ?? 0), ...drawn },
    [buffer],
  );
}

/** Says what is amiss while the picture stays. */
function hint(message) {
  postMessage({ type: "error", message, isFatal: false });
}

/** Fetches what the last frame lacks, and gives up the rest. */
function fetchMore() {
  if (ranges) ranges.want(viewer.requests());
}

/** Says if the view needs more than fits. */
function sayFull() {
  const before = isFull;
  isFull = viewer.is_full();
  if (isFull && !before) {
    const message = "This view needs more of the file than a page may hold, and is shown coarser. Come closer to see more.";
    hint(message);
  }
}

/** Says what was fetched so far. */
function sayFetched() {
  postMessage({ type: "fetched", ...ranges.sums, isBusy: ranges.isBusy });
}

/** Returns why the CPU engine draws before WebGPU was asked, or nothing. */
function withoutGpu(wanted) {
  if (wanted === "cpu") return "The page asks for the CPU engine.";
  if (!isSecureContext) return "Browsers have WebGPU only for pages by https, of this machine or in files.";
  return navigator.gpu ? "" : "This browser has no WebGPU.";
}

/** Finds what draws: WebGPU on a GPU, or what the page asks for. */
async function engineFor(wanted) {
  const onProcessor = (reason) => [Engine.cpu(), { engine: "cpu", reason }];
  const reason = withoutGpu(wanted);
  if (reason) return onProcessor(reason);
  try {
    webgpu ??= await Engine.webgpu();
  } catch (error) {
    return onProcessor(String(error?.message ?? error));
  }
  if (wanted !== "gpu" && webgpu.is_software()) {
    return onProcessor("WebGPU runs on the processor here, where the CPU engine is faster.");
  }
  return [webgpu, { engine: "webgpu", reason: "" }];
}

/** Makes the viewer, and fetches what it needs to begin. */
async function made(scene, held, engine, size) {
  for (;;) {
    try {
      return new Viewer(scene, held, engine, ...size);
    } catch (error) {
      const wanted = held.requests();
      if (wanted.length === 0 || error instanceof WebAssembly.RuntimeError) throw error;
      await new Promise((done, fail) => {
        ranges.hear = {
          arrive: (file, start, bytes) => held.arrive(file, start, bytes),
          problem: (message, isFinal) => (isFinal ? fail(new Error(message)) : hint(message)),
          idle: done,
        };
        ranges.want(wanted);
      });
    }
  }
}

/** Opens a scene. Files are buffers, or addresses of files that come in parts. */
async function open({ scene, files, engine, width, height }) {
  const mine = ++opening;
  ranges?.close();
  helpers?.close();
  helpers = null;
  viewer?.free();
  viewer = null;
  isFull = false;
  drags.clear();
  const held = new Files();
  // Browsers that tell it round it, and tell of at most some GiB.
  if (navigator.deviceMemory) held.set_machine(navigator.deviceMemory);
  const fetching = new Ranges({ arrive() {}, problem: hint, idle() {} });
  ranges = files.some(([, file]) => typeof file === "string") ? fetching : null;
  for (const [name, file] of files) {
    if (typeof file !== "string") {
      held.add(name, new Uint8Array(file));
      continue;
    }
    const { whole, size, bytes } = await fetching.open(file);
    if (mine !== opening) return;
    if (whole) held.add(name, new Uint8Array(whole));
    else held.arrive(held.add_parts(name, size), 0, bytes);
  }
  const [device, means] = await engineFor(engine);
  const next = await made(scene, held, device, [width, height]);
  if (mine !== opening) return next.free();
  opened = { scene, held, width, height };
  [viewer, drawn] = [next, means];
  if (drawn.engine === "webgpu" && !viewer.is_gpu()) goOn();
  fetching.hear = {
    arrive(file, start, bytes) {
      try {
        viewer?.arrive(file, start, bytes);
      } catch (error) {
        complain(error);
      }
      sayFetched();
      schedule();
    },
    problem: hint,
    idle: sayFetched,
  };
  isRough = viewer.is_rough();
  postMessage({
    type: "load",
    summary: viewer.summary(),
    warnings: viewer.warnings(),
    transfers: viewer.transfers(),
    ...drawn,
  });
  if (ranges) sayFetched();
  schedule();
}

/** What the page may ask for, by name. */
const answers = {
  open(message) {
    if (message.wasm) {
      compiled = new WebAssembly.Module(message.wasm);
      ({ memory } = initSync({ module: compiled }));
    }
    const mine = opening + 1;
    open(message).catch((error) => mine === opening && complain(error));
  },
  helper({ port, opening: for_ }) {
    if (for_ === opening && helpers && !helpers.isClosed) helpers.add(port);
    else port.close();
  },
  drag({ kind, x, y }) {
    const [sumX, sumY] = drags.get(kind) ?? [0, 0];
    drags.set(kind, [sumX + x, sumY + y]);
  },
  grab: ({ x, y }) => viewer.grab(x, y),
  zoom: ({ factor, x, y }) => viewer.zoom(factor, x, y),
  center: ({ x, y }) => viewer.center(x, y),
  fly: ({ right, up, forward }) => viewer.fly(right, up, forward),
  fit: ({ side }) => viewer.fit(side),
  perspective: () => viewer.perspective(),
  resize: ({ width, height }) => viewer.resize(width, height),
  camera: ({ camera }) => viewer.set_camera(camera),
  transfer: ({ field, transfer }) => viewer.set_transfer(field, transfer),
  clips: ({ clips }) => viewer.set_clips(clips),
  point: ({ x, y, id }) => postMessage({ type: "point", id, point: [...viewer.point(x, y)] }),
};

onmessage = ({ data }) => {
  try {
    if (data.type === "help") return help(data.port);
    if (!viewer && data.type !== "open") return;
    // What was dragged before comes before.
    if (data.type !== "drag" && viewer) applyDrags();
    answers[data.type](data);
    schedule();
  } catch (error) {
    complain(error);
  }
};
