// Framed pages get the theme of the site, also when it is switched.

const scheme = () => (document.body.dataset.mdColorScheme === "slate" ? "dark" : "light");

const share = (frame) => frame.contentWindow.postMessage({ theme: scheme() }, "*");

for (const frame of document.querySelectorAll("iframe")) {
  frame.addEventListener("load", () => share(frame));
  share(frame);
}

new MutationObserver(() => document.querySelectorAll("iframe").forEach(share)).observe(
  document.body,
  { attributeFilter: ["data-md-color-scheme"] },
);
