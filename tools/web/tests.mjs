// Tests of pages in a browser: tools/web/test runs them.
//
//   node tests.mjs SPLATKIT VIEWER WORK [CASE …]
//
// SPLATKIT is the command, VIEWER the folder of the viewer, and WORK a folder for what is made.
// Pictures that are worth a look stay in WORK.

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import { createRequire } from "node:module";
import path from "node:path";

const [splatkit, viewer, work, ...wanted] = process.argv.slice(2);
const { chromium } = createRequire(path.join(work, "../node/"))("playwright-core");
const SIZE = [640, 480];
/** The least likeness of a page's picture to that of `splatkit render`, in dB. */
const LEAST = 60;
const PATIENCE = 180_000;

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

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox"],
});

/** Opens a page, and hears its events and its faults. */
async function opened(address, options = {}) {
  const [width, height] = SIZE;
  const context = await browser.newContext({ viewport: { width, height }, ...options });
  const page = await context.newPage();
  page.faults = [];
  page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
  page.on("pageerror", (error) => page.faults.push(error.message));
  await page.addInitScript(() => {
    window.heard = [];
    for (const name of ["load", "frame", "rest", "error", "camerachange"]) {
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

/** Serves a folder. */
function served(folder) {
  const kinds = { html: "text/html", js: "text/javascript", wasm: "application/wasm", json: "application/json" };
  const server = http.createServer((request, response) => {
    const file = path.join(folder, decodeURIComponent(new URL(request.url, "http://a").pathname));
    const whole = file.endsWith("/") ? `${file}index.html` : file;
    if (!fs.existsSync(whole)) return response.writeHead(404).end();
    response.writeHead(200, { "content-type": kinds[whole.split(".").pop()] ?? "application/octet-stream" });
    fs.createReadStream(whole).pipe(response);
  });
  return new Promise((answer) => server.listen(0, "127.0.0.1", () => answer(server)));
}

tests["a folder"] = async () => {
  fs.rmSync(at("site"), { recursive: true, force: true });
  const look = ["demo/knot.ply", "demo/tetra.obj", "--background", "#10141c"];
  run("publish", ...look, "-o", "site", "--viewer", viewer);
  run("render", ...look, "--size", SIZE.join("x"), "--engine", "cpu", "-o", "site-native.png", "--overwrite");
  const server = await served(at("site"));
  const address = `http://127.0.0.1:${server.address().port}/`;
  const page = await opened(address);
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
process.exit(failed ? 1 : 0);
