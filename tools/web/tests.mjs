// Tests of pages in a browser: tools/web/test runs them.
//
//   node tests.mjs SPLATKIT VIEWER WORK [CASE …]
//
// SPLATKIT is the command, VIEWER the folder of the viewer, and WORK a folder for what is made.
// Pictures that are worth a look stay in WORK.

import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import { createRequire } from "node:module";
import path from "node:path";

const [splatkit, viewer, work, ...wanted] = process.argv.slice(2);
const { chromium } = createRequire(path.join(work, "../node/"))("playwright-core");
const SIZE = [640, 480];
/** The least likeness of a page's picture to that of `splatkit render`, in dB. */
const LEAST = 60;
/** SwiftShader compiles the shaders of a volume for half a minute. */
const PATIENCE = 600_000;

const run = (...args) => execFileSync(splatkit, ["--quiet", ...args], { cwd: work, encoding: "utf8" });
const at = (name) => path.join(work, name);

/** Makes the inputs, unless they are there. */
function makeInputs() {
  if (!fs.existsSync(at("demo/made.spz"))) run("demo", "demo", "--overwrite");
  if (!fs.existsSync(at("demo/specimen.splv"))) run("convert", "demo/specimen.nrrd", "-o", "demo/specimen.splv");
  const points = [];
  for (let i = 0; i < 4000; i++) {
    const [turn, height] = [i * 2.399963, 1 - (2 * i + 1) / 4000];
    const ring = Math.sqrt(1 - height * height);
    points.push([ring * Math.cos(turn), ring * Math.sin(turn), height].map((v) => v.toFixed(6)).join(" "));
  }
  fs.writeFileSync(at("demo/ball.xyz"), points.join("\n") + "\n");
  fs.writeFileSync(at("demo/paint.mtl"), "newmtl red\nKd 0.9 0.2 0.1\n");
  const corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  fs.writeFileSync(at("demo/tetra.obj"), `mtllib paint.mtl\n${corners}usemtl red\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n`);
}

/** What is published: the arguments of the command. */
const TRANSFER = ["--transfer", "demo/specimen.json"];
const CASES = {
  mesh: ["demo/knot.ply"],
  cloud: ["demo/ball.xyz", "--color", "height"],
  hierarchy: ["demo/knot.splk"],
  volume: ["demo/specimen.nrrd", ...TRANSFER, "--clip", "x<50%"],
  bricks: ["demo/specimen.splv", ...TRANSFER],
  gaussians: ["demo/made.spz"],
  mixed: ["demo/made.spz", "demo/knot.ply", "demo/specimen.nrrd", ...TRANSFER, "--azimuth", "-25", "--zoom", "1.5"],
};

const launched = (...args) =>
  chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox", ...args] });
const browser = await launched();
/** Chromium with WebGPU on the processor: slow, and the same on all machines. */
let withGpu = null;
const SOFTWARE = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-unsafe-swiftshader"];

/** Opens a page, and hears its events and its faults. */
async function opened(address, { isGpu = false, size = SIZE, ...options } = {}) {
  const [width, height] = size;
  if (isGpu) withGpu ??= await launched(...SOFTWARE);
  const context = await (isGpu ? withGpu : browser).newContext({ viewport: { width, height }, ...options });
  const page = await context.newPage();
  page.faults = [];
  page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
  page.on("pageerror", (error) => page.faults.push(error.message));
  await page.addInitScript(() => {
    window.heard = [];
    for (const name of ["load", "frame", "rest", "error", "camerachange", "fetched"]) {
      document.addEventListener(
        name,
        (event) => event.target.localName === "splatkit-viewer" && heard.push({ name, ...event.detail, at: performance.now() }),
        true,
      );
    }
  });
  await page.goto(address);
  return page;
}

/** Waits for the exact picture, and returns what was heard until then. */
async function rested(page) {
  await page.waitForFunction(() => heard.some(({ name }) => name === "rest" || name === "error"), null, { timeout: PATIENCE });
  return page.evaluate(() => heard.splice(0));
}

/** Saves what the canvas shows. */
async function saved(page, name) {
  const data = await page.evaluate(() => document.querySelector("splatkit-viewer").canvas.toDataURL());
  fs.writeFileSync(at(name), Buffer.from(data.split(",")[1], "base64"));
}

/** Returns the likeness of two pictures, in dB. */
function likeness(a, b) {
  const { stdout } = spawnSync(splatkit, ["compare", "--json", at(a), at(b)], { encoding: "utf8" });
  const { psnr, psnr_db } = JSON.parse(stdout);
  const value = psnr ?? psnr_db;
  return value === null || value === undefined ? Infinity : Number(value);
}

function ended(events) {
  const error = events.find(({ name }) => name === "error");
  assert.equal(error, undefined, error?.message);
  const frames = events.filter(({ name }) => name === "frame");
  assert.ok(frames.at(-1)?.isExact, "the exact picture is shown at last");
  return frames;
}

const tests = {};
for (const [name, args] of Object.entries(CASES)) {
  tests[name] = async () => {
    const look = [...args, "--background", "#10141c"];
    run("publish", ...look, "-o", `${name}.html`, "--overwrite", "--viewer", viewer);
    run("render", ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", `${name}-native.png`, "--overwrite");
    const page = await opened(`file://${at(`${name}.html`)}`);
    const events = await rested(page);
    const frames = ended(events);
    await saved(page, `${name}-page.png`);
    await page.screenshot({ path: at(`${name}-screen.png`) });
    const alike = likeness(`${name}-page.png`, `${name}-native.png`);
    assert.deepEqual(page.faults, []);
    assert.ok(alike >= LEAST, `the page shows another picture than render: ${alike} dB`);
    const bytes = fs.statSync(at(`${name}.html`)).size;
    await page.context().close();
    const [first, last] = [frames[0].at, frames.at(-1).at].map((time) => (time / 1000).toFixed(1));
    return `${alike} dB, ${(bytes / 1e6).toFixed(1)} MB, first ${first} s, exact ${last} s`;
  };
}

/** Makes a page in one file draw by WebGPU, even on the processor. */
function asksForGpu(from, to) {
  const text = fs.readFileSync(at(from), "utf8");
  fs.writeFileSync(at(to), text.replace("<splatkit-viewer ", '<splatkit-viewer engine="gpu" '));
}

/** Whether this machine has what `splatkit render` needs to draw by a GPU, or by its software. */
const hasVulkan = spawnSync(splatkit, ["gpus"], { encoding: "utf8" }).stdout?.trim() !== "";

/** Draws with the GPU engine, or with the CPU engine where there is no driver. */
const renderedByGpu = (look, out, size = SIZE) =>
  run("render", ...look, "--size", size.join("x"), "--engine", hasVulkan ? "gpu" : "cpu", "-o", out, "--overwrite");

/** Pictures of bricks and files in parts are small: SwiftShader takes minutes for larger ones. */
const SMALL = [240, 180];

for (const [name, args] of Object.entries(CASES)) {
  const size = name === "bricks" ? SMALL : SIZE;
  tests[`${name} by WebGPU`] = async () => {
    const look = [...args, "--background", "#10141c"];
    run("publish", ...look, "-o", `${name}.html`, "--overwrite", "--viewer", viewer);
    asksForGpu(`${name}.html`, `${name}-webgpu.html`);
    renderedByGpu(look, `${name}-gpu.png`, size);
    const page = await opened(`file://${at(`${name}-webgpu.html`)}`, { isGpu: true, size });
    const events = await rested(page);
    const frames = ended(events);
    assert.deepEqual(new Set(frames.map(({ engine }) => engine)), new Set(["webgpu"]), frames.at(-1).reason);
    await saved(page, `${name}-webgpu.png`);
    const alike = likeness(`${name}-webgpu.png`, `${name}-gpu.png`);
    assert.deepEqual(page.faults, []);
    assert.ok(alike >= (hasVulkan ? LEAST : 45), `the page shows another picture than render: ${alike} dB`);
    const { camera, moving } = await turnedALittle(page, size);
    // Back by a program: the same picture, byte for byte.
    await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), camera);
    ended(await rested(page));
    await saved(page, `${name}-webgpu-back.png`);
    assert.equal(likeness(`${name}-webgpu.png`, `${name}-webgpu-back.png`), Infinity);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    const [first, last] = [frames[0].at, frames.at(-1).at].map((time) => (time / 1000).toFixed(1));
    return `${alike} dB, first ${first} s, exact ${last} s, drawn in ${Math.round(frames.at(-1).milliseconds)} ms, moving in ${moving} ms`;
  };
}

/** Turns a scene by the mouse. Returns the camera before, and what a moving frame takes. */
async function turnedALittle(page, size) {
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  const [x, y] = size.map((side) => side / 2);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let step = 1; step <= 20; step++) {
    await page.mouse.move(x + (6 * step * size[0]) / SIZE[0], y + step);
    await page.waitForTimeout(30);
  }
  await page.mouse.up();
  const frames = ended(await rested(page));
  const times = frames.filter(({ width }) => width < size[0]).map(({ milliseconds }) => milliseconds);
  times.sort((a, b) => a - b);
  return { camera, moving: Math.round(times[times.length >> 1]) };
}

/** What makes a worker lose its device when the page asks for it. */
const LOSES = `{
  const request = GPUAdapter.prototype.requestDevice;
  GPUAdapter.prototype.requestDevice = async function (...all) {
    const device = await request.apply(this, all);
    new BroadcastChannel("lose").onmessage = () => device.destroy();
    return device;
  };
}
`;

/** Serves a scene whose page draws by WebGPU, with a worker that can lose its device. */
async function losingServed(look) {
  fs.rmSync(at("lost"), { recursive: true, force: true });
  run("publish", ...look, "-o", "lost", "--viewer", viewer);
  asksForGpu("lost/index.html", "lost/index.html");
  const worker = at("lost/splatkit-worker.js");
  fs.writeFileSync(worker, LOSES + fs.readFileSync(worker, "utf8"));
  return served(at("lost"));
}

/** Serves a published scene, whose worker believes in so many cores. `more` comes before it. */
async function servedWithCores(name, cores, more = "") {
  const folder = at(`cores-${name}-${cores}`);
  fs.rmSync(folder, { recursive: true, force: true });
  fs.mkdirSync(folder);
  const believes = `Object.defineProperty(navigator, "hardwareConcurrency", { value: ${cores} });\n${more}\n`;
  fs.writeFileSync(path.join(folder, "splatkit-worker.js"), believes + fs.readFileSync(path.join(viewer, "splatkit-worker.js"), "utf8"));
  return served([folder, at(`cores-${name}`)]);
}

const median = (numbers) => numbers.toSorted((a, b) => a - b)[numbers.length >> 1];

/** Draws the exact picture some times, and turns the scene. Returns the times of frames. */
async function timed(page, workers) {
  const again = () => page.evaluate(() => { const one = document.querySelector("splatkit-viewer"); one.camera = one.camera; });
  const exact = [];
  for (let turn = 0; exact.length < 5 && turn < 40; turn++) {
    await again();
    const frames = ended(await rested(page));
    if (frames.at(-1).workers === workers) exact.push(frames.at(-1).milliseconds);
    else await page.waitForTimeout(500);
  }
  assert.equal(exact.length, 5, `${workers} workers draw`);
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  await page.mouse.move(320, 240);
  await page.mouse.down();
  for (let step = 1; step <= 60; step++) {
    await page.mouse.move(320 + 4 * step, 240 + step);
    await page.waitForTimeout(30);
  }
  await page.mouse.up();
  // The first ones find the pace.
  const moving = ended(await rested(page)).filter(({ width }) => width < SIZE[0]).slice(5);
  await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), camera);
  ended(await rested(page));
  const [time, width] = ["milliseconds", "width"].map((what) => Math.round(median(moving.map((frame) => frame[what]))));
  return `${Math.round(median(exact))} ms exact, ${time} ms moving at ${width} pixels`;
}

for (const name of ["mesh", "volume", "mixed"]) {
  tests[`${name} by several workers`] = async () => {
    const look = [...CASES[name], "--background", "#10141c"];
    fs.rmSync(at(`cores-${name}`), { recursive: true, force: true });
    run("publish", ...look, "-o", `cores-${name}`, "--viewer", viewer);
    const said = [];
    // Four are more than some machines have: their picture is the same.
    for (const workers of name === "volume" ? [1, 2, 4] : [1, 2]) {
      const server = await servedWithCores(name, workers);
      const page = await opened(server.address);
      ended(await rested(page));
      said.push(`${workers}: ${await timed(page, workers)}`);
      await saved(page, `cores-${name}-${workers}.png`);
      // Byte for byte.
      assert.equal(likeness(`cores-${name}-1.png`, `cores-${name}-${workers}.png`), Infinity);
      assert.deepEqual(page.faults.filter((fault) => !fault.includes("favicon")), []);
      assert.equal(page.workers().length, workers);
      await page.evaluate(() => document.querySelector("splatkit-viewer").close());
      await page.waitForTimeout(200);
      assert.equal(page.workers().length, 0, "all workers are ended");
      await page.context().close();
      server.close();
    }
    return said.join("; ");
  };
}

tests["a helper that fails"] = async () => {
  const look = [...CASES.volume, "--background", "#10141c"];
  fs.rmSync(at("cores-failing"), { recursive: true, force: true });
  run("publish", ...look, "-o", "cores-failing", "--viewer", viewer);
  const said = [];
  // While it opens the scene, while it draws, and without a word.
  const faults = {
    opening: `addEventListener("message", ({ data }) => data.type === "help" && (WebAssembly.Instance = class { constructor() { throw new Error("no"); } }));`,
    drawing: `addEventListener("message", ({ data }) => data.type === "help" && setTimeout(() => (viewer.help = () => { throw new WebAssembly.RuntimeError("no"); }), 1500));`,
    silent: `addEventListener("message", ({ data }) => data.type === "help" && setTimeout(() => (viewer.help = () => { for (;;); }), 1500));`,
  };
  for (const [when, more] of Object.entries(faults)) {
    const server = await servedWithCores("failing", 2, more);
    const page = await opened(server.address);
    ended(await rested(page));
    await page.waitForTimeout(2500);
    await page.evaluate(() => { const one = document.querySelector("splatkit-viewer"); one.camera = one.camera; });
    const frames = ended(await rested(page));
    assert.equal(frames.at(-1).workers, 1, when);
    await saved(page, `cores-failing-${when}.png`);
    if (said.length > 0) assert.equal(likeness(`cores-failing-${when}.png`, "cores-failing-opening.png"), Infinity);
    assert.deepEqual(page.faults.filter((fault) => !fault.includes("favicon")), []);
    said.push(when);
    await page.context().close();
    server.close();
  }
  return said.join(", ");
};

tests["a lost device"] = async () => {
  const look = [...CASES.cloud, "--background", "#10141c"];
  const server = await losingServed(look);
  run("render", ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", "lost-native.png", "--overwrite");
  const said = [];
  // At rest, and while it draws.
  for (const wait of [500, 0]) {
    const page = await opened(server.address, { isGpu: true });
    assert.equal(ended(await rested(page)).at(-1).engine, "webgpu");
    await page.evaluate(async (wait) => {
      const one = document.querySelector("splatkit-viewer");
      const { camera } = one;
      const lose = () => new BroadcastChannel("lose").postMessage(0);
      const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
      if (wait) lose();
      await pause(wait);
      one.camera = camera;
      await pause(40);
      if (!wait) lose();
    }, wait);
    await page.waitForFunction(() => heard.some(({ name }) => name === "error"), null, { timeout: PATIENCE });
    await page.waitForFunction(() => heard.some(({ name }) => name === "rest"), null, { timeout: PATIENCE });
    const events = await page.evaluate(() => heard.splice(0));
    const problem = events.find(({ name }) => name === "error");
    assert.match(problem.message, /^The processor draws from now on, because WebGPU failed: .*(was lost|did not return)/);
    assert.equal(problem.isFatal, false);
    const last = events.filter(({ name }) => name === "frame").at(-1);
    assert.deepEqual([last.engine, last.isExact], ["cpu", true]);
    await saved(page, `lost-page-${wait}.png`);
    const alike = likeness(`lost-page-${wait}.png`, "lost-native.png");
    assert.ok(alike >= LEAST, `${alike} dB`);
    await page.screenshot({ path: at(`lost-screen-${wait}.png`) });
    said.push(`${alike} dB`);
    await page.context().close();
  }
  server.close();
  return said.join(", ");
};

/** The shaders that `cargo test` wrote, given to the browser's compiler. */
if (process.env.SPLATKIT_SHADERS) {
  tests.shaders = async () => {
    const folder = process.env.SPLATKIT_SHADERS;
    const names = fs.readdirSync(folder).filter((name) => name.endsWith(".wgsl"));
    const server = await served(folder);
    fs.writeFileSync(path.join(folder, "index.html"), "<!doctype html>");
    const page = await opened(server.address, { isGpu: true });
    const problems = await page.evaluate(async (names) => {
      const adapter = await navigator.gpu.requestAdapter();
      const device = await adapter.requestDevice({ requiredLimits: { maxStorageBuffersPerShaderStage: 9 } });
      const problems = [];
      for (const name of names) {
        const code = await (await fetch(name)).text();
        const module = device.createShaderModule({ code });
        const { messages } = await module.getCompilationInfo();
        problems.push(...messages.map(({ type, message, lineNum }) => `${name}:${lineNum}: ${type}: ${message}`));
        const entryPoint = code.split("\n")[0].slice(3);
        if (messages.length > 0 || !code.includes(`@compute`)) continue;
        try {
          await device.createComputePipelineAsync({ layout: "auto", compute: { module, entryPoint } });
        } catch (error) {
          problems.push(`${name}: ${error.message}`);
        }
      }
      return problems;
    }, names);
    await page.context().close();
    server.close();
    assert.deepEqual(problems, []);
    return `${names.length} compile`;
  };
}

tests["what WebGPU does not draw"] = async () => {
  const look = ["demo/specimen.nrrd", ...TRANSFER, "--kernel", "linear", "--background", "#10141c"];
  run("publish", ...look, "-o", "refused.html", "--overwrite", "--viewer", viewer);
  run("render", ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", "refused-native.png", "--overwrite");
  asksForGpu("refused.html", "refused-webgpu.html");
  const engines = [];
  // Refused by the engine, not asked for on the processor, and not there.
  const pages = [["refused-webgpu", true, /linear/], ["refused", true, /runs on the processor/], ["refused-webgpu", false, /no WebGPU/]];
  for (const [name, isGpu, reason] of pages) {
    const page = await opened(`file://${at(`${name}.html`)}`, { isGpu });
    await page.waitForFunction(() => heard.some(({ name }) => name === "rest"), null, { timeout: PATIENCE });
    const frame = (await page.evaluate(() => heard.splice(0))).filter(({ name }) => name === "frame").at(-1);
    assert.deepEqual([frame.engine, frame.isExact], ["cpu", true]);
    assert.match(frame.reason, reason);
    engines.push(frame.reason);
    await saved(page, "refused-page.png");
    const alike = likeness("refused-page.png", "refused-native.png");
    assert.ok(alike >= LEAST, `${alike} dB`);
    await page.context().close();
  }
  return engines.join(" | ");
};

tests["a ruler"] = async () => {
  if (!fs.existsSync(at("mesh.html"))) await tests.mesh();
  const page = await opened(`file://${at("mesh.html")}`);
  ended(await rested(page));
  const viewer = page.locator("splatkit-viewer");
  // The first and the last place of a row that show the mesh, and their points.
  const [first, last] = await viewer.evaluate(async (one) => {
    one.measured = [];
    one.addEventListener("measure", ({ detail }) => one.measured.push(detail));
    one.canvas.focus();
    const places = [];
    for (let x = 20; x < 620; x += 10) {
      const point = await one.pointAt(x, 240);
      if (point) places.push({ x, point });
    }
    one.annotations = [{ point: places[0].point, text: "here" }];
    return [places[0], places.at(-1)];
  });
  await page.keyboard.press("m");
  for (const { x } of [first, last]) {
    await page.mouse.click(x, 240);
    await page.waitForTimeout(400);
  }
  const length = Math.hypot(...first.point.map((side, axis) => side - last.point[axis]));
  const [measured] = await viewer.evaluate((one) => one.measured);
  assert.ok(Math.abs(measured.length - length) < 1e-6, `${measured.length} instead of ${length}`);
  const marks = () =>
    viewer.evaluate((one) =>
      [...one.shadowRoot.querySelectorAll(".marks circle")].map((mark) => Number(mark.getAttribute("cx"))),
    );
  const places = await marks();
  [first.x, last.x, first.x].forEach((x, number) => assert.ok(Math.abs(places[number] - x) < 1, `${places}`));
  await saved(page, "ruler.png");
  // M ends it; the annotation stays.
  await page.keyboard.press("m");
  assert.equal((await marks()).length, 1);
  await page.context().close();
  return `${length.toPrecision(4)} between two clicks`;
};

tests["a hand"] = async () => {
  if (!fs.existsSync(at("mixed.html"))) await tests.mixed();
  const page = await opened(`file://${at("mixed.html")}`, { colorScheme: "light" });
  ended(await rested(page));
  await saved(page, "hand-before.png");
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  await page.mouse.move(320, 240);
  await page.mouse.down();
  for (let step = 1; step <= 20; step++) {
    await page.mouse.move(320 + 6 * step, 240 + step);
    await page.waitForTimeout(30);
  }
  await page.mouse.up();
  const events = await rested(page);
  const frames = ended(events);
  const moving = frames.filter(({ width }) => width < SIZE[0]);
  assert.ok(moving.length >= 2, "coarse frames while the hand moves");
  assert.ok(events.some(({ name }) => name === "camerachange"));
  await saved(page, "hand-after.png");
  assert.ok(likeness("hand-before.png", "hand-after.png") < 25, "the drag changed nothing");
  // By the keyboard.
  await page.locator("splatkit-viewer").evaluate((one) => one.canvas.focus());
  await page.keyboard.press("7");
  ended(await rested(page));
  const top = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  assert.notDeepEqual(top.position, camera.position);
  // Back by a program: the same picture, byte for byte.
  await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), camera);
  ended(await rested(page));
  await saved(page, "hand-back.png");
  assert.equal(likeness("hand-before.png", "hand-back.png"), Infinity);
  // What cannot be is said in words, and the picture stays.
  await page.evaluate(() => document.querySelector("splatkit-viewer").fit("inside"));
  await page.waitForFunction(() => heard.some(({ name }) => name === "error"));
  const [problem] = await page.evaluate(() => heard.splice(0));
  assert.match(problem.message, /no side “inside”/);
  assert.deepEqual(page.faults, []);
  const label = await page.evaluate(() => document.querySelector("splatkit-viewer").canvas.getAttribute("aria-label"));
  assert.match(label, /knot\.ply/);
  await page.context().close();
  const times = moving.map(({ milliseconds }) => milliseconds).sort((a, b) => a - b);
  return `${moving.length} moving frames of ${Math.round(times[times.length >> 1])} ms`;
};

const KINDS = { html: "text/html", js: "text/javascript", wasm: "application/wasm", json: "application/json", css: "text/css" };
/** A policy that compiles WebAssembly, and makes no programs of texts. */
const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:";

/** Answers with the part of a file that a request asks for. */
function sendPart(request, response, file, given) {
  const { size, mtimeMs } = fs.statSync(file);
  const tag = `"${size}-${mtimeMs}"`;
  response.setHeader("etag", tag);
  const wanted = request.headers["if-match"];
  if (wanted && wanted !== tag) return response.writeHead(412).end();
  const [start, end] = [Number(given[1]), Math.min(Number(given[2]) + 1, size)];
  if (start >= size) return response.writeHead(416).end();
  response.writeHead(206, { "content-range": `bytes ${start}-${end - 1}/${size}`, "content-length": end - start });
  fs.createReadStream(file, { start, end: end - 1 }).pipe(response);
}

/** Serves folders, the first that has a file. `answers` may answer before: it returns whether it
 *  has. With `ranges`, requests for parts are answered. `log` has each of those. */
function served(folders, { answers, ranges = false, policy } = {}) {
  const log = [];
  const server = http.createServer((request, response) => {
    const name = decodeURIComponent(new URL(request.url, "http://a").pathname);
    const places = [folders].flat().map((folder) => path.join(folder, name.endsWith("/") ? `${name}index.html` : name));
    const whole = places.find((place) => fs.existsSync(place));
    if (policy) response.setHeader("content-security-policy", policy);
    const given = ranges && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
    if (given && whole) log.push({ name, start: Number(given[1]), end: Number(given[2]) + 1 });
    if (answers?.(request, response, whole)) return;
    if (!whole) return response.writeHead(404).end();
    response.setHeader("content-type", KINDS[whole.split(".").pop()] ?? "application/octet-stream");
    if (!given) {
      response.writeHead(200);
      return fs.createReadStream(whole).pipe(response);
    }
    sendPart(request, response, whole, given);
  });
  return new Promise((answer) =>
    server.listen(0, "127.0.0.1", () => answer(Object.assign(server, { log, address: `http://127.0.0.1:${server.address().port}/` }))),
  );
}

tests["a folder"] = async () => {
  fs.rmSync(at("site"), { recursive: true, force: true });
  const look = ["demo/knot.ply", "demo/tetra.obj", "--background", "#10141c"];
  run("publish", ...look, "-o", "site", "--viewer", viewer);
  run("render", ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", "site-native.png", "--overwrite");
  const server = await served(at("site"));
  const page = await opened(server.address);
  ended(await rested(page));
  await saved(page, "site-page.png");
  assert.deepEqual(page.faults.filter((fault) => !fault.includes("favicon")), []);
  const alike = likeness("site-page.png", "site-native.png");
  // The second input has a material in another file, and so becomes a hierarchy.
  assert.ok(alike >= 35, `${alike} dB`);
  // A file that is gone is named.
  fs.renameSync(at("site/knot.ply"), at("site/gone.ply"));
  await page.reload();
  const [problem] = await rested(page);
  assert.match(problem.message, /knot\.ply: the server answers 404/);
  await page.screenshot({ path: at("site-problem.png") });
  await page.context().close();
  server.close();
  return `${alike} dB`;
};

const look = ["--background", "#10141c"];
/** Points of the cloud, and samples of the volume along each axis, that are read in ranges. */
const POINTS = Number(process.env.POINTS ?? 3_000_000);
const SIDE = Number(process.env.SAMPLES ?? 224);

/** Makes a cloud and a volume that are large enough to be read in parts. */
function makeLarge() {
  fs.mkdirSync(at("large"), { recursive: true });
  if (!fs.existsSync(at(`large/cloud-${POINTS}.splk`))) {
    const bytes = Buffer.alloc(15 * POINTS);
    for (let i = 0; i < POINTS; i++) {
      const [turn, height] = [i * 2.399963, 1 - (2 * i + 1) / POINTS];
      const ring = Math.sqrt(1 - height * height);
      const far = 1 + 0.1 * Math.sin(9 * height) * Math.cos(5 * turn) + 0.02 * Math.sin(61 * height);
      [ring * Math.cos(turn), ring * Math.sin(turn), height].forEach((v, axis) => bytes.writeFloatLE(v * far, 15 * i + 4 * axis));
      bytes.set([128 + 100 * Math.sin(7 * height), 128 + 90 * Math.cos(3 * turn), (i * 7919) % 256], 15 * i + 12);
    }
    const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${POINTS}\n${["x", "y", "z"].map((n) => `property float ${n}\n`).join("")}${["red", "green", "blue"].map((n) => `property uchar ${n}\n`).join("")}end_header\n`;
    fs.writeFileSync(at("large/cloud.ply"), Buffer.concat([Buffer.from(header), bytes]));
    run("convert", "large/cloud.ply", "-o", `large/cloud-${POINTS}.splk`);
  }
  if (!fs.existsSync(at(`large/field-${SIDE}.splv`))) {
    const bytes = Buffer.alloc(SIDE ** 3);
    for (let z = 0, i = 0; z < SIDE; z++)
      for (let y = 0; y < SIDE; y++)
        for (let x = 0; x < SIDE; x++, i++) {
          const [a, b, c] = [x, y, z].map((v) => (2 * v) / SIDE - 1);
          const body = 1 - Math.hypot(a, b, c) + 0.25 * Math.sin(9 * a) * Math.sin(8 * b) * Math.sin(7 * c);
          bytes[i] = Math.max(0, Math.min(255, 180 * body + 6 * (((i * 2654435761) >>> 16) % 16) / 16));
        }
    const header = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: ${SIDE} ${SIDE} ${SIDE}\nencoding: raw\n\n`;
    fs.writeFileSync(at("large/field.nrrd"), Buffer.concat([Buffer.from(header), bytes]));
    run("convert", "large/field.nrrd", "-o", `large/field-${SIDE}.splv`);
  }
  const page = (file) =>
    `<!doctype html><html><head><meta charset="utf-8"><link rel="icon" href="data:,"><style>html,body{margin:0;height:100%;background:#10141c}splatkit-viewer{position:fixed;inset:0}</style></head><body><splatkit-viewer src="${file}"></splatkit-viewer><script type="module" src="splatkit-viewer.js"></script></body></html>`;
  const files = { cloud: `cloud-${POINTS}.splk`, field: `field-${SIDE}.splv` };
  for (const [name, file] of Object.entries(files)) {
    const scene = { splatkit_scene: 2, inputs: [{ file }], picture: { background: "#10141c" } };
    fs.writeFileSync(at(`large/${name}.json`), JSON.stringify(scene));
    fs.writeFileSync(at(`large/${name}.html`), page(`${name}.json`));
  }
  return files;
}

/** Serves the large files with the viewer. */
const largeServed = (options) => served([at("large"), viewer], { ranges: true, ...options });

/** Waits until a frame is shown. */
const firstFrame = (page) => page.waitForFunction(() => heard.some(({ name }) => name === "frame" || name === "error"), null, { timeout: PATIENCE });

for (const kind of ["cloud", "field"]) {
  tests[`${kind} in ranges`] = async () => {
    const file = makeLarge()[kind];
    run("render", `large/${file}`, ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", `${kind}-native.png`, "--overwrite");
    const server = await largeServed();
    const page = await opened(`${server.address}${kind}.html`);
    await firstFrame(page);
    await page.screenshot({ path: at(`${kind}-first.png`) });
    const events = await rested(page);
    const frames = ended(events);
    await saved(page, `${kind}-ranges.png`);
    assert.deepEqual(page.faults, []);
    const alike = likeness(`${kind}-ranges.png`, `${kind}-native.png`);
    assert.ok(alike >= LEAST, `the page shows another picture than render: ${alike} dB`);
    const before = events.slice(0, events.indexOf(frames[0])).filter(({ name }) => name === "fetched").at(-1);
    const { size } = fs.statSync(at(`large/${file}`));
    const all = server.log.reduce((sum, { start, end }) => sum + Math.min(end, size) - start, 0);
    assert.ok(before.bytes <= 1 << 20, `${before.bytes} bytes before the first picture`);
    // Far away, a part is enough; and nothing comes twice.
    assert.ok(server.log.length > 3 && all <= 1.05 * size, `${server.log.length} requests of ${all} bytes`);
    // The same as from the whole file.
    run("publish", `large/${file}`, ...look, "-o", `${kind}-whole.html`, "--overwrite", "--viewer", viewer);
    const whole = await opened(`file://${at(`${kind}-whole.html`)}`);
    ended(await rested(whole));
    await saved(whole, `${kind}-whole.png`);
    assert.equal(likeness(`${kind}-ranges.png`, `${kind}-whole.png`), Infinity);
    await whole.context().close();
    // Closer: more parts come, and the picture is exact again.
    const far = server.log.length;
    await page.mouse.move(300, 220);
    for (let step = 0; step < 5; step++) await page.mouse.wheel(0, -200);
    ended(await rested(page));
    await page.screenshot({ path: at(`${kind}-close.png`) });
    const close = server.log.length - far;
    await page.context().close();
    server.close();
    const [first, last] = [frames[0].at, frames.at(-1).at].map((time) => (time / 1000).toFixed(1));
    return `${alike} dB, ${(size / 1e6).toFixed(1)} MB, first ${first} s after ${(before.bytes / 1e6).toFixed(2)} MB, exact ${last} s after ${(all / 1e6).toFixed(1)} MB in ${far} requests, ${close} closer`;
  };
}

for (const kind of ["cloud", "field"]) {
  tests[`${kind} in ranges by WebGPU`] = async () => {
    const file = makeLarge()[kind];
    renderedByGpu([`large/${file}`, ...look], `${kind}-ranges-gpu.png`, SMALL);
    asksForGpu(`large/${kind}.html`, `large/${kind}-webgpu.html`);
    // A slow line: pictures are drawn before all has come.
    const answers = (request, response, whole) => {
      const part = whole && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
      if (!part || part[1] === "0") return false;
      setTimeout(() => sendPart(request, response, whole, part), 300);
      return true;
    };
    const server = await largeServed({ answers });
    const page = await opened(`${server.address}${kind}-webgpu.html`, { isGpu: true, size: SMALL });
    await firstFrame(page);
    await saved(page, `${kind}-ranges-webgpu-first.png`);
    const events = await rested(page);
    const frames = ended(events);
    assert.deepEqual(new Set(frames.map(({ engine }) => engine)), new Set(["webgpu"]), frames.at(-1).reason);
    // Coarse, then finer, and exact only once all has come.
    assert.ok(frames.length >= 3 && frames.filter(({ isExact }) => isExact).length === 1);
    const { isBusy, bytes } = events.slice(0, events.indexOf(frames.at(-1))).filter(({ name }) => name === "fetched").at(-1);
    assert.equal(isBusy, false);
    await saved(page, `${kind}-ranges-webgpu.png`);
    assert.deepEqual(page.faults, []);
    const [coarse, alike] = ["-first", ""].map((which) => likeness(`${kind}-ranges-webgpu${which}.png`, `${kind}-ranges-gpu.png`));
    assert.ok(coarse < alike && alike >= (hasVulkan ? LEAST : 45), `first ${coarse} dB, then ${alike} dB`);
    await page.context().close();
    server.close();
    return `first ${coarse} dB, then ${alike} dB after ${frames.length} frames and ${(bytes / 1e6).toFixed(1)} MB`;
  };
}

tests["a view that moves on"] = async () => {
  makeLarge();
  // A slow line: requests for parts take a while.
  let given = 0;
  const server = await largeServed({
    answers(request, response, file) {
      const part = file && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
      if (!part || part[1] === "0") return false;
      const timer = setTimeout(() => sendPart(request, response, file, part), 1500);
      response.on("close", () => {
        clearTimeout(timer);
        if (!response.writableFinished) given++;
      });
      return true;
    },
  });
  const page = await opened(`${server.address}cloud.html`);
  await firstFrame(page);
  await page.waitForTimeout(300);
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  const [x, y, z] = camera.focal_point;
  for (let turn = 0; turn < 6; turn++) {
    const near = { ...camera, position: [x + 1.3 * Math.cos(turn), y + 1.3 * Math.sin(turn), z + 0.2] };
    await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), near);
    await page.waitForTimeout(800);
  }
  await page.evaluate(() => heard.splice(0));
  await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), { ...camera, position: [x + 1.2, y, z] });
  const events = await rested(page);
  ended(events);
  const { cancelled, requests } = events.filter(({ name }) => name === "fetched").at(-1);
  // Those that waited in the browser never reached the server.
  assert.ok(cancelled > 0 && given <= cancelled, `${cancelled} of ${requests} requests were given up, ${given} on the way`);
  assert.deepEqual(page.faults, []);
  await page.context().close();
  server.close();
  return `${cancelled} of ${requests} requests were given up`;
};

tests["a replaced file"] = async () => {
  const { cloud } = makeLarge();
  fs.rmSync(at("replaced"), { recursive: true, force: true });
  fs.mkdirSync(at("replaced"));
  const copy = at(`replaced/${cloud}`);
  fs.copyFileSync(at(`large/${cloud}`), copy);
  const server = await served([at("replaced"), at("large"), viewer], { ranges: true });
  const page = await opened(`${server.address}cloud.html`);
  ended(await rested(page));
  await saved(page, "replaced-before.png");
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  // The same length, other bytes, another time.
  const bytes = fs.readFileSync(copy);
  bytes.subarray(bytes.length / 2).fill(7);
  fs.writeFileSync(copy, bytes);
  await page.mouse.move(300, 220);
  for (let step = 0; step < 5; step++) await page.mouse.wheel(0, -200);
  await page.waitForFunction(() => heard.some(({ name }) => name === "error"), null, { timeout: PATIENCE });
  const [problem] = (await page.evaluate(() => heard.splice(0))).filter(({ name }) => name === "error");
  assert.match(problem.message, /cloud-\d+\.splk was replaced on the server/);
  assert.equal(problem.isFatal, false);
  await page.screenshot({ path: at("replaced.png") });
  // What came before can still be seen.
  await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), camera);
  ended(await rested(page));
  await saved(page, "replaced-after.png");
  assert.equal(likeness("replaced-before.png", "replaced-after.png"), Infinity);
  await page.context().close();
  server.close();
  return "said in words";
};

tests["a connection that is cut"] = async () => {
  makeLarge();
  let [isCut, cuts] = [true, 0];
  const server = await largeServed({
    answers(request, response, file) {
      if (!isCut || !file || !request.headers.range || request.headers.range.startsWith("bytes=0-")) return false;
      cuts++;
      const [, start, last] = /bytes=(\d+)-(\d+)/.exec(request.headers.range);
      const { size, mtimeMs } = fs.statSync(file);
      response.writeHead(206, { etag: `"${size}-${mtimeMs}"`, "content-range": `bytes ${start}-${last}/${size}`, "content-length": last - start + 1 });
      response.write(Buffer.alloc(1000));
      setTimeout(() => request.socket.destroy(), 50);
      return true;
    },
  });
  const page = await opened(`${server.address}field.html`);
  await page.waitForFunction(() => heard.some(({ name }) => name === "error"), null, { timeout: PATIENCE });
  const events = await page.evaluate(() => heard.splice(0));
  const problem = events.find(({ name }) => name === "error");
  assert.match(problem.message, /connection was cut.*It is tried again/);
  assert.equal(problem.isFatal, false);
  await page.screenshot({ path: at("cut.png") });
  isCut = false;
  ended(await rested(page));
  await saved(page, "cut-page.png");
  if (!fs.existsSync(at("field-ranges.png"))) await tests["field in ranges"]();
  assert.equal(likeness("cut-page.png", "field-ranges.png"), Infinity);
  await page.context().close();
  server.close();
  return `${cuts} connections were cut`;
};

tests["a server without ranges"] = async () => {
  makeLarge();
  const answers = (request, response, file) => {
    if (!file?.endsWith(".splk")) return false;
    response.writeHead(200, { "content-length": 9e9 });
    response.write(Buffer.alloc(1000));
    return true;
  };
  const server = await largeServed({ answers });
  const page = await opened(`${server.address}cloud.html`);
  const problem = (await rested(page)).find(({ name }) => name === "error");
  assert.match(problem.message, /sends the whole file, more than 64\.0 MB, when it is asked for a part/);
  assert.equal(problem.isFatal, true);
  await page.screenshot({ path: at("without-ranges.png") });
  await page.context().close();
  server.closeAllConnections();
  server.close();
  return "said in words";
};

tests["splatkit serve"] = async () => {
  const { cloud } = makeLarge();
  const process = spawn(splatkit, ["--quiet", "serve", `large/${cloud}`, ...look, "--no-open", "--viewer", viewer], { cwd: work });
  try {
    const line = await new Promise((done) => process.stdout.once("data", done));
    const [address] = /http:\S+/.exec(line);
    const page = await opened(address);
    ended(await rested(page));
    await saved(page, "serve-page.png");
    if (!fs.existsSync(at("cloud-ranges.png"))) await tests["cloud in ranges"]();
    assert.equal(likeness("serve-page.png", "cloud-ranges.png"), Infinity);
    assert.deepEqual(page.faults, []);
    await page.context().close();
    const part = await fetch(`${address}${cloud}`, { headers: { range: "bytes=5-9" } });
    const tag = part.headers.get("etag");
    assert.deepEqual([part.status, (await part.arrayBuffer()).byteLength], [206, 5]);
    const other = await fetch(`${address}${cloud}`, { headers: { range: "bytes=5-9", "if-match": '"x"' } });
    assert.equal(other.status, 412);
    const head = await fetch(`${address}${cloud}`, { method: "HEAD" });
    assert.deepEqual([head.headers.get("etag"), Number(head.headers.get("content-length"))], [tag, fs.statSync(at(`large/${cloud}`)).size]);
    const status = fs.existsSync(`/proc/${process.pid}/status`) && fs.readFileSync(`/proc/${process.pid}/status`, "utf8");
    return status ? `${Math.round(/VmHWM:\s+(\d+)/.exec(status)[1] / 1024)} MiB at most` : "as in ranges";
  } finally {
    process.kill();
  }
};

/** The seconds of a flight. FLIGHT=300 POINTS=5000000 shows whether memory stays bounded. */
const FLIGHT = Number(process.env.FLIGHT ?? 12);

/** Returns the megabytes of a page: of the engine, of JavaScript, and of its process. */
async function memoryOf(page) {
  const engine = await page.workers()[0].evaluate(() => memory.buffer.byteLength);
  const script = await page.evaluate(() => performance.memory.usedJSHeapSize);
  const cdp = await browser.newBrowserCDPSession();
  const { processInfo } = await cdp.send("SystemInfo.getProcessInfo");
  await cdp.detach();
  const resident = ({ id }) => {
    const status = fs.existsSync(`/proc/${id}/status`) ? fs.readFileSync(`/proc/${id}/status`, "utf8") : "";
    return 1024 * Number(/VmRSS:\s+(\d+)/.exec(status)?.[1] ?? 0);
  };
  const renderers = processInfo.filter(({ type }) => type === "renderer").map(resident);
  return [engine, script, Math.max(...renderers)].map((bytes) => Math.round(bytes / 2 ** 20));
}

/** Flies around and into a cloud, with rests, and back. Returns what the page takes meanwhile. */
async function flown(page) {
  const camera = await page.evaluate(() => document.querySelector("splatkit-viewer").camera);
  const [end, samples] = [performance.now() + 1000 * FLIGHT, []];
  for (let step = 0; performance.now() < end && page.workers().length > 0; step++) {
    const [turn, far] = [0.11 * step, 1.6 + 1.3 * Math.sin(0.07 * step)];
    const position = [far * Math.cos(turn), far * Math.sin(turn), Math.sin(0.03 * step)].map((v, axis) => camera.focal_point[axis] + v);
    await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), { ...camera, position });
    await page.waitForTimeout(step % 25 === 24 ? 2500 : 120);
    if (step % 10 === 0) samples.push(await memoryOf(page));
  }
  await page.evaluate((camera) => (document.querySelector("splatkit-viewer").camera = camera), camera);
  await page.waitForTimeout(200);
  return samples;
}

tests["a long flight"] = async () => {
  const { cloud } = makeLarge();
  const process = spawn(splatkit, ["--quiet", "serve", `large/${cloud}`, ...look, "--no-open", "--viewer", viewer], { cwd: work });
  try {
    const line = await new Promise((done) => process.stdout.once("data", done));
    const page = await opened(/http:\S+/.exec(line)[0]);
    await firstFrame(page);
    const samples = await flown(page);
    const events = await page.evaluate(() => heard.splice(0));
    assert.equal(events.find(({ name }) => name === "error"), undefined);
    ended(await rested(page));
    samples.push(await memoryOf(page));
    assert.deepEqual(page.faults, []);
    await page.context().close();
    const most = (from, to) => [0, 1, 2].map((kind) => Math.max(...samples.slice(from, to).map((sample) => sample[kind])));
    const half = samples.length >> 1;
    const [first, second] = [most(0, half), most(half)];
    fs.writeFileSync(at("flight.json"), JSON.stringify(samples));
    assert.ok(second[0] <= 2048 && second[1] <= 256, `${second} MiB`);
    // Long flights have seen everything in their first half.
    if (FLIGHT >= 120) assert.ok(second[0] <= 1.1 * first[0] && second[2] <= 1.15 * first[2], `${first}, then ${second} MiB`);
    const frames = events.filter(({ name }) => name === "frame").length;
    return `${frames} frames in ${FLIGHT} s; engine ${first[0]}, then ${second[0]} MiB, script ${first[1]}, then ${second[1]} MiB, process ${first[2]}, then ${second[2]} MiB`;
  } finally {
    process.kill();
  }
};

/** Returns an engine whose memory cannot have more than these MiB. */
function withMemory(wasm, most) {
  const leb = (value) => (value < 128 ? [value] : [(value & 127) | 128, ...leb(value >> 7)]);
  const read = (at) => {
    let [value, shift] = [0, 0];
    for (; wasm[at] & 128; at++, shift += 7) value |= (wasm[at] & 127) << shift;
    return [value | (wasm[at] << shift), at + 1];
  };
  for (let at = 8; at < wasm.length; ) {
    const [size, start] = read(at + 1);
    if (wasm[at] === 5) {
      const [least] = read(start + 2);
      const section = [1, 1, ...leb(least), ...leb(16 * most)];
      return Buffer.concat([wasm.subarray(0, at), Buffer.from([5, ...leb(section.length), ...section]), wasm.subarray(start + size)]);
    }
    at = start + size;
  }
  throw new Error("the engine has no memory");
}

/** Serves the large files with an engine of so many MiB, in a browser that tells so many GiB. */
async function littleServed(most, machine) {
  makeLarge();
  const folder = at("little");
  fs.mkdirSync(folder, { recursive: true });
  const [engine, worker] = ["splatkit.wasm", "splatkit-worker.js"].map((file) => fs.readFileSync(path.join(viewer, file)));
  fs.writeFileSync(path.join(folder, "splatkit.wasm"), withMemory(engine, most));
  fs.writeFileSync(path.join(folder, "splatkit-worker.js"), `Object.defineProperty(navigator, "deviceMemory", { value: ${machine} });\n${worker}`);
  fs.writeFileSync(path.join(folder, "whole.html"), fs.readFileSync(at("large/cloud.html"), "utf8").replace("cloud.json", "cloud.ply"));
  return served([folder, at("large"), viewer], { ranges: true });
}

tests["a flight in a small memory"] = async () => {
  const server = await littleServed(384, 1);
  const page = await opened(`${server.address}cloud.html`);
  await firstFrame(page);
  const samples = await flown(page);
  const events = await page.evaluate(() => heard.splice(0));
  assert.ok(!events.some(({ name, isFatal }) => name === "error" && isFatal), events.find(({ name }) => name === "error")?.message);
  assert.deepEqual(page.faults, []);
  await page.context().close();
  server.close();
  return `${Math.max(...samples.map(([engine]) => engine))} MiB at most, in ${events.filter(({ name }) => name === "frame").length} frames`;
};

tests["a small memory"] = async () => {
  const said = [];
  // The name, the MiB of the engine, and the GiB that the browser tells. The whole file is too large; in
  // parts there is enough for the view, or words.
  for (const [name, most, machine] of [["whole", 192, 8], ["whole", 320, 8], ["cloud", 96, 8], ["cloud", 512, 8], ["cloud", 384, 1]]) {
    const server = await littleServed(most, machine);
    const page = await opened(`${server.address}${name}.html`);
    const events = await rested(page);
    const error = events.find(({ name }) => name === "error");
    const what = `${name} in ${most} MiB, ${machine} GiB told`;
    if (error) {
      assert.match(error.message, /memory|shown coarser/);
      assert.ok(!events.some(({ name, isExact }) => name === "frame" && isExact), "words, or an exact picture");
      said.push(`${what}: ${error.message}`);
    } else {
      ended(events);
      await saved(page, `little-${name}.png`);
      run("render", name === "whole" ? "large/cloud.ply" : `large/cloud-${POINTS}.splk`, ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", "little-native.png", "--overwrite");
      const alike = likeness(`little-${name}.png`, "little-native.png");
      assert.ok(alike >= LEAST, `${alike} dB`);
      said.push(`${what}: ${alike} dB`);
    }
    await page.screenshot({ path: at(`little-${name}-${most}.png`) });
    await page.context().close();
    server.close();
  }
  assert.match(said[0], /needs more memory|needs \d+ bytes of memory|engine stopped/);
  // What a small machine tells keeps its page alive.
  assert.doesNotMatch(said.at(-1), /engine stopped/);
  return said.join("; ");
};

tests["a package"] = async () => {
  const made = path.join(viewer, "../package");
  const { name, version, exports, files } = JSON.parse(fs.readFileSync(path.join(made, "package.json"), "utf8"));
  assert.match(version, /^\d+\.\d+\.\d+/);
  for (const file of [...files, exports["."].types, exports["."].default]) assert.ok(fs.existsSync(path.join(made, file)), file);
  const { cloud } = makeLarge();
  const project = at("vite");
  fs.mkdirSync(path.join(project, "public"), { recursive: true });
  const packed = execFileSync("npm", ["pack", "--silent", "--pack-destination", project, made], { encoding: "utf8" }).trim().split("\n").at(-1);
  fs.writeFileSync(path.join(project, "package.json"), JSON.stringify({ name: "look", private: true, type: "module", dependencies: { [name]: `file:./${packed}` } }));
  fs.writeFileSync(path.join(project, "index.html"), `<!doctype html><html><head><link rel="icon" href="data:,"></head><body><script type="module" src="main.js"></script></body></html>`);
  fs.writeFileSync(
    path.join(project, "main.js"),
    `import { SplatkitViewer } from "${name}";\nconst one = new SplatkitViewer();\none.style.cssText = "position:fixed;inset:0";\none.src = "./cloud.json";\ndocument.body.append(one);\n`,
  );
  for (const file of ["cloud.json", cloud]) fs.copyFileSync(at(`large/${file}`), path.join(project, "public", file));
  fs.rmSync(path.join(project, "node_modules", name), { recursive: true, force: true });
  execFileSync("npm", ["install", "--silent", "--no-package-lock", "vite@7", packed], { cwd: project });
  execFileSync("npx", ["vite", "build", "--base", "./", "--logLevel", "warn"], { cwd: project });
  const said = [];
  for (const folders of [[path.join(project, "dist")], [at("large"), made]]) {
    const server = await served(folders, { ranges: true, policy: POLICY });
    const page = await opened(`${server.address}${said.length === 0 ? "" : "cloud.html"}`);
    ended(await rested(page));
    await saved(page, `package-${said.length}.png`);
    assert.deepEqual(page.faults, []);
    if (!fs.existsSync(at("cloud-ranges.png"))) await tests["cloud in ranges"]();
    assert.equal(likeness(`package-${said.length}.png`, "cloud-ranges.png"), Infinity);
    said.push(`${server.log.length} requests`);
    await page.context().close();
    server.close();
  }
  return `${name} ${version}: by Vite ${said[0]}, as it is ${said[1]}`;
};

makeInputs();
let failed = 0;
for (const [name, test] of Object.entries(tests)) {
  if (wanted.length > 0 && !wanted.includes(name)) continue;
  try {
    console.log(`ok      ${name}: ${await test()}`);
  } catch (error) {
    failed++;
    console.log(`FAILED  ${name}: ${error.message}`);
  }
}
await browser.close();
await withGpu?.close();
process.exit(failed ? 1 : 0);
