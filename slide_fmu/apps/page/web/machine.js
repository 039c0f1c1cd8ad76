// The surrogate's runtime, as WebAssembly: the calls of slide_fmu/fmu/runtime/wasm/page.h.

/** Loads the runtime; the result serves any number of machines. */
export async function loadRuntime(bytes) {
  const { instance } = await WebAssembly.instantiate(bytes, {});
  instance.exports._initialize();
  return instance.exports;
}

/** What the runtime refused, with its own words. */
export class Refused extends Error {}

/** A group of variables that are set or read together. */
class Port {
  constructor(machine, references) {
    this.machine = machine;
    this.count = references.length;
    this.references = machine.room(4 * this.count);
    this.place = machine.room(8 * this.count);
    this.view = new Float64Array(0);
    new Uint32Array(machine.runtime.memory.buffer, this.references, this.count).set(references);
  }

  /** The values in the memory of the runtime; when that memory grows, a view becomes empty. */
  get values() {
    if (this.view.length === 0) {
      this.view = new Float64Array(this.machine.runtime.memory.buffer, this.place, this.count);
    }
    return this.view;
  }

  /** Sets the variables to values. */
  set(values) {
    const place = this.values;
    for (let i = 0; i < this.count; i += 1) {
      place[i] = values[i];
    }
    const { runtime, page } = this.machine;
    this.machine.expect(runtime.slide_page_set(page, this.references, this.count, this.place));
  }

  /** Reads the variables; the array is overwritten by the next call. */
  get() {
    const { runtime, page } = this.machine;
    this.machine.expect(runtime.slide_page_get(page, this.references, this.count, this.place));
    return this.values;
  }
}

/** One instance of a surrogate, which steps through time. */
export class Machine {
  /** Reads a surrogate file, a Uint8Array. */
  constructor(runtime, surrogate) {
    this.runtime = runtime;
    const data = this.room(surrogate.length);
    new Uint8Array(runtime.memory.buffer, data, surrogate.length).set(surrogate);
    this.page = runtime.slide_page_open(data, surrogate.length);
    runtime.slide_page_give_back(data);
    if (this.page === 0) {
      throw new Refused("there is no memory left for the surrogate; close other pages");
    }
    const refusal = this.message();
    if (refusal !== "") {
      runtime.slide_page_close(this.page);
      throw new Refused(refusal);
    }
  }

  /** Room in the memory of the runtime, which it keeps. */
  room(size) {
    const place = this.runtime.slide_page_room(Math.max(size, 8));
    if (place === 0) {
      throw new Refused(`there is no memory left for ${size} bytes; close other pages`);
    }
    return place;
  }

  /** Names variables, by their value references, that are set or read together. */
  port(references) {
    return new Port(this, references);
  }

  /** Goes back before the start, where parameters may be set. */
  reset() {
    this.expect(this.runtime.slide_page_reset(this.page));
  }

  /** Begins to run, at 0 s. */
  start() {
    this.expect(this.runtime.slide_page_start(this.page));
  }

  /** Takes in the inputs, and goes on by a time in s. */
  step(length) {
    this.expect(this.runtime.slide_page_step(this.page, length));
  }

  message() {
    const memory = new Uint8Array(this.runtime.memory.buffer);
    const begin = this.runtime.slide_page_message(this.page);
    return new TextDecoder().decode(memory.slice(begin, memory.indexOf(0, begin)));
  }

  expect(status) {
    if (status !== 0) {
      throw new Refused(this.message());
    }
  }
}
