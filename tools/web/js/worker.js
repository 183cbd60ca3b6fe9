// The worker that holds the engine: it hears the page, and draws strip by strip between messages.
//
// tools/web/build puts this behind the glue of wasm-bindgen, whose `initSync`, `Files` and `Viewer`
// it uses.

let viewer = null;
let isScheduled = false;
/** Whether the page knows that nothing moves. */
let isResting = true;
/** Pointers move more often than frames are drawn: drags are summed up until the next one. */
let drags = new Map();
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
  if (isTrap) viewer = null;
  postMessage({ type: "error", message: text, isFatal: isTrap || !viewer });
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
    if (wait === -1) {
      if (!isResting) postMessage({ type: "rest" });
      isResting = true;
      return;
    }
    isResting = false;
    if (wait === -2) showFrame();
    schedule(Math.max(wait, 0));
  } catch (error) {
    complain(error);
  }
}

function showFrame() {
  const [width, height, exact, milliseconds] = viewer.frame();
  const { buffer } = viewer.pixels();
  const camera = viewer.camera();
  postMessage(
    { type: "frame", width, height, isExact: exact === 1, milliseconds, camera, buffer },
    [buffer],
  );
}

/** What the page may ask for, by name. */
const answers = {
  open({ wasm, scene, files, width, height }) {
    if (wasm) initSync({ module: wasm });
    viewer?.free();
    viewer = null;
    drags.clear();
    const held = new Files();
    for (const [name, buffer] of files) held.add(name, new Uint8Array(buffer));
    viewer = new Viewer(scene, held, width, height);
    postMessage({
      type: "load",
      summary: viewer.summary(),
      warnings: viewer.warnings(),
      transfers: viewer.transfers(),
    });
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
    if (!viewer && data.type !== "open") return;
    // What was dragged before comes before.
    if (data.type !== "drag" && viewer) applyDrags();
    answers[data.type](data);
    schedule();
  } catch (error) {
    complain(error);
  }
};
