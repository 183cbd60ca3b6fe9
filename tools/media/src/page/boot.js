// The start of a page in one file: the viewer, the scene and its files are elements of the page.

/** The bytes whose columns were turned at once. */
const BLOCK = 1 << 18;

/** What unpacks lzip: the exports of tools/web/unpack. */
let unpacker = null;

/** Takes bytes out of letters of seven bits. */
function bytesOf(text) {
  const bytes = new Uint8Array(Math.floor((text.length * 7) / 8));
  let [held, count, at] = [0, 0, 0];
  for (let place = 0; place < text.length; place++) {
    held = (held << 7) | (text.charCodeAt(place) & 127);
    count += 7;
    if (count >= 8) {
      count -= 8;
      bytes[at++] = held >> count;
      held &= (1 << count) - 1;
    }
  }
  return bytes;
}

/** Makes rows of columns again, block by block. */
function turnedBack(turned, strides) {
  const bytes = new Uint8Array(turned.length);
  let at = 0;
  strides.forEach((stride, block) => {
    const start = block * BLOCK;
    const end = Math.min(start + BLOCK, bytes.length);
    for (let column = 0; column < stride; column++) {
      let last = 0;
      for (let place = start + column; place < end; place += stride) {
        last = (last + turned[at++]) & 255;
        bytes[place] = last;
      }
    }
  });
  return bytes;
}

/** Unpacks gzip, as browsers do. */
async function gunzipped(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Unpacks lzip to this many bytes. */
function unzipped(packed, count) {
  const { memory, room, unpack } = unpacker;
  const place = room(packed.length);
  new Uint8Array(memory.buffer).set(packed, place);
  const start = unpack(count);
  if (start === 0) throw new Error("damaged");
  return new Uint8Array(memory.buffer, start, count).slice();
}

/** Takes the bytes out of an element. */
async function unpacked(element) {
  const { by, count, strides } = element.dataset;
  const packed = bytesOf(element.textContent);
  element.remove();
  let bytes;
  try {
    bytes = by === "lzip" ? unzipped(packed, Number(count)) : await gunzipped(packed);
  } catch {
    throw new Error("This page is damaged: a part of it cannot be unpacked. Get the file again; programs that change texts may have changed it.");
  }
  const widths = strides.split(" ").filter(Boolean).map(Number);
  return (widths.length > 0 ? turnedBack(bytes, widths) : bytes).buffer;
}

async function start() {
  const module = await unpacked(document.getElementById("unpacker"));
  unpacker = (await WebAssembly.instantiate(module)).instance.exports;
  const worker = await unpacked(document.getElementById("worker"));
  resources.worker = () =>
    new Worker(URL.createObjectURL(new Blob([worker], { type: "text/javascript" })));
  const engine = await unpacked(document.getElementById("engine"));
  resources.wasm = () => engine.slice(0);
  const scene = document.getElementById("scene").textContent;
  const files = [];
  for (const file of document.querySelectorAll("script[data-file]")) {
    files.push([file.dataset.file, await unpacked(file)]);
  }
  // Its memory is given back.
  unpacker = null;
  await shown.open(scene, files);
}

const shown = document.querySelector("splatkit-viewer");
start().catch((error) => shown.complain(error.message));
