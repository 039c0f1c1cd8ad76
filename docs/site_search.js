// Search in pages that are opened from disk. Browsers start no workers there, so the script of the
// search runs in a hidden frame; site_hooks.py writes its index as a script.

class FrameWorker extends EventTarget {
  constructor(url) {
    super();
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    this.frame.srcdoc = "<!doctype html><title>search</title>";
    this.ready = new Promise((resolve) => {
      this.frame.addEventListener("load", () => resolve(this.begin(url)));
    });
    document.body.append(this.frame);
  }

  /** Runs the script of the worker in the frame, where a message goes to the page. */
  async begin(url) {
    const inside = this.frame.contentWindow;
    const run = (source) =>
      new Promise((resolve, reject) => {
        const script = inside.document.createElement("script");
        script.addEventListener("load", resolve);
        script.addEventListener("error", reject);
        script.src = source;
        inside.document.body.append(script);
      });
    inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
    inside.importScripts = (...sources) => Promise.all(sources.map(run));
    await run(url);
    return inside;
  }

  async postMessage(data) {
    const inside = await this.ready;
    inside.dispatchEvent(new inside.MessageEvent("message", { data }));
  }

  terminate() {
    this.frame.remove();
  }
}

if (location.protocol === "file:") {
  window.Worker = FrameWorker;
}
