// The start of a page in one file: the viewer, the scene and its files are elements of the page.

/** The bytes whose columns were turned at once. */
const BLOCK = 1 << 18;

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
  return bytes.buffer;
}

/** Takes the bytes out of an element. */
async function unpacked(element) {
  const packed = bytesOf(element.textContent);
  element.remove();
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  let bytes;
  try {
    bytes = await new Response(stream).arrayBuffer();
  } catch {
    throw new Error("This page is damaged: a part of it cannot be unpacked. Get the file again; programs that change texts may have changed it.");
  }
  const strides = element.dataset.strides.split(" ").filter(Boolean).map(Number);
  return strides.length > 0 ? turnedBack(new Uint8Array(bytes), strides) : bytes;
}

async function start() {
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
  await shown.open(scene, files);
}

const shown = document.querySelector("splatkit-viewer");
start().catch((error) => shown.complain(error.message));
