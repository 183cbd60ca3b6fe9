// Files on a server that are read in ranges: hierarchies (.splk) and volumes in bricks (.splv).
//
// tools/web/build puts this before worker.js. `Ranges` opens files, fetches what the view needs, and
// gives up what it no longer needs. It never mixes the bytes of a file that was replaced.

/** The bytes of the first request of a file. */
const FIRST = 256 * 1024;
/** A server that answers with the whole file may do so with at most these bytes. */
const SMALL = 64e6;
/** The most requests at once. */
const PARALLEL = 6;
/** The milliseconds before a request is tried again: at first, and at most. They double. */
const [SOON, LATE] = [500, 15000];

const inMegabytes = (bytes) => `${(bytes / 1e6).toFixed(1)} MB`;

/** An answer that will not change when the request is repeated. */
class Refusal extends Error {}

/** Says how a server answered. Those answers that may change are no refusals. */
function badAnswer(file, { status, statusText }) {
  const text = `${file.url}: the server answers ${status} ${statusText}`.trim();
  const mayChange = status >= 500 || status === 408 || status === 425 || status === 429;
  return mayChange ? new Error(text) : new Refusal(text);
}

const replaced = (file) =>
  new Refusal(`${file.url} was replaced on the server while it was shown. Reload the page to see the new file.`);

/** What tells one version of a file from another. */
const versionOf = ({ headers }) => [headers.get("etag"), headers.get("last-modified")].join(" ");

class Ranges {
  #files = [];
  /** Has `arrive(file, start, bytes)`, `problem(message, isFinal)` and `idle()`. */
  hear;
  /** The requests that are under way, with the ranges that they fetch. */
  #running = new Set();
  #wanted = [];
  #failures = 0;
  #timer = null;
  #isClosed = false;
  /** What was fetched: requests and bytes, also of those that were given up. */
  sums = { requests: 0, bytes: 0, cancelled: 0 };

  constructor(hear) {
    this.hear = hear;
  }

  /** Opens a file: its first bytes come, and with them its size; or, if it is small and the server
   *  has no ranges, all of it. */
  async open(url) {
    const file = { url, size: null, version: "", tag: null, isGone: false };
    for (let failures = 0; ; failures++) {
      try {
        return await this.#first(file);
      } catch (error) {
        if (error instanceof Refusal || this.#isClosed || failures === 5) throw error;
        if (failures > 0) this.hear.problem(`${error.message}. It is tried again.`);
        await new Promise((done) => setTimeout(done, Math.min(SOON * 2 ** failures, LATE)));
      }
    }
  }

  async #first(file) {
    const response = await this.#asked(file, 0, FIRST);
    if (response.status === 200) {
      const whole = await this.#whole(file, response);
      this.sums.bytes += whole.byteLength;
      return { whole };
    }
    if (response.status !== 206) throw badAnswer(file, response);
    const range = /^bytes 0-(\d+)\/(\d+)$/.exec(response.headers.get("content-range") ?? "");
    if (!range) {
      response.body?.cancel();
      throw new Refusal(
        `${file.url}: the answer has no size (Content-Range). From another origin, the server must name it: Access-Control-Expose-Headers: Content-Range, ETag`,
      );
    }
    file.size = Number(range[2]);
    file.version = versionOf(response);
    const tag = response.headers.get("etag");
    // From another origin, this header would need a second request, which asks whether it may be.
    const isNear = new URL(file.url).origin === self.location?.origin;
    if (isNear && tag && !tag.startsWith("W/")) file.tag = tag;
    const bytes = await this.#bytesOf(file, response, Number(range[1]) + 1);
    return { number: this.#files.push(file) - 1, size: file.size, bytes };
  }

  /** Takes all of a small file from a server without ranges. Answers need not say how long they
   *  are. */
  async #whole(file, response) {
    const [parts, reader] = [[], response.body.getReader()];
    let size = Number(response.headers.get("content-length")) || 0;
    for (let held = 0; size <= SMALL; ) {
      const { done, value } = await reader.read().catch(() => {
        throw new Error(`${file.url}: the connection was cut`);
      });
      if (done) return new Blob(parts).arrayBuffer();
      parts.push(value);
      held += value.length;
      size = Math.max(size, held);
    }
    reader.cancel().catch(() => {});
    throw new Refusal(
      `${file.url}: the server sends the whole file, more than ${inMegabytes(SMALL)}, when it is asked for a part. Put it on a host that answers range requests, as most static hosts and \`splatkit serve\` do.`,
    );
  }

  /** Asks for a range. */
  async #asked(file, start, end, signal) {
    const headers = { Range: `bytes=${start}-${end - 1}` };
    if (file.tag) headers["If-Match"] = file.tag;
    this.sums.requests++;
    try {
      return await fetch(file.url, { headers, signal });
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new Error(`${file.url} cannot be reached`);
    }
  }

  /** Takes all bytes of an answer. */
  async #bytesOf(file, response, count) {
    let bytes;
    try {
      bytes = new Uint8Array(await response.arrayBuffer());
    } catch (error) {
      if (error.name === "AbortError") throw error;
      throw new Error(`${file.url}: the connection was cut`);
    }
    this.sums.bytes += bytes.length;
    if (bytes.length !== count) throw new Error(`${file.url}: the connection was cut after ${bytes.length} of ${count} bytes`);
    return bytes;
  }

  /** Fetches a range of an opened file. */
  async #part(file, start, end, signal) {
    const response = await this.#asked(file, start, end, signal);
    const { status } = response;
    if (status === 206) {
      const range = response.headers.get("content-range");
      if (versionOf(response) === file.version && range === `bytes ${start}-${end - 1}/${file.size}`) {
        return this.#bytesOf(file, response, end - start);
      }
    }
    response.body?.cancel().catch(() => {});
    if (status === 206 || status === 412 || status === 416) throw replaced(file);
    if (status === 200) {
      if (versionOf(response) !== file.version) throw replaced(file);
      throw new Refusal(`${file.url}: the server no longer answers requests for parts, but sends the whole file`);
    }
    throw badAnswer(file, response);
  }

  /** What the view needs now, the most important first: [file, start, end] one after another. What
   *  is under way and no longer needed is given up. */
  want(numbers) {
    const wanted = [];
    for (let at = 0; at < numbers.length; at += 3) {
      const [file, start, end] = numbers.subarray(at, at + 3);
      if (!this.#files[file].isGone) wanted.push({ file, start, end });
    }
    const meets = (a, b) => a.file === b.file && a.start < b.end && b.start < a.end;
    for (const one of this.#running) {
      if (wanted.some((other) => meets(one, other))) continue;
      this.sums.cancelled++;
      this.#running.delete(one);
      one.abort.abort();
    }
    // What is under way is not asked for twice.
    this.#wanted = wanted.flatMap((one) => {
      let rest = [one];
      for (const { file, start, end } of this.#running) {
        if (file !== one.file) continue;
        rest = rest.flatMap((part) => [
          { ...part, end: Math.min(part.end, start) },
          { ...part, start: Math.max(part.start, end) },
        ]).filter((part) => part.start < part.end);
      }
      return rest;
    });
    this.#go();
  }

  /** Whether something is under way or waits. */
  get isBusy() {
    return this.#running.size > 0 || this.#wanted.length > 0;
  }

  #go() {
    if (this.#timer || this.#isClosed) return;
    // After a failure, one request at a time shows whether the server is back.
    const most = this.#failures > 0 ? 1 : PARALLEL;
    while (this.#wanted.length > 0 && this.#running.size < most) this.#start(this.#wanted.shift());
    if (!this.isBusy) this.hear.idle();
  }

  async #start(one) {
    one.abort = new AbortController();
    this.#running.add(one);
    const file = this.#files[one.file];
    try {
      const bytes = await this.#part(file, one.start, one.end, one.abort.signal);
      if (!this.#running.delete(one)) return;
      this.#failures = 0;
      this.hear.arrive(one.file, one.start, bytes);
    } catch (error) {
      if (!this.#running.delete(one) || error.name === "AbortError") return;
      if (error instanceof Refusal) this.#leave(one.file, error.message);
      else this.#retry(one, error.message);
    }
    this.#go();
  }

  /** Asks nothing more of a file. What is shown stays. */
  #leave(number, message) {
    if (this.#files[number].isGone) return;
    this.#files[number].isGone = true;
    this.#wanted = this.#wanted.filter(({ file }) => file !== number);
    this.hear.problem(message, true);
  }

  /** Asks again after a while. */
  #retry(one, message) {
    this.#wanted.unshift({ file: one.file, start: one.start, end: one.end });
    if (this.#timer) return;
    const wait = Math.min(SOON * 2 ** this.#failures, LATE);
    this.#failures++;
    if (this.#failures === 3) this.hear.problem(`${message}. It is tried again; what is shown stays.`);
    this.#timer = setTimeout(() => {
      this.#timer = null;
      this.#go();
    }, wait);
  }

  /** Gives up everything. */
  close() {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    for (const { abort } of this.#running) abort.abort();
    this.#running.clear();
    this.#wanted = [];
  }
}
