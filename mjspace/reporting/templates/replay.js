"use strict";
(() => {
  const frame = document.getElementById("viewer");
  const start = Number(frame.dataset.start), speed = Number(frame.dataset.speed);
  const { plots } = uPlot.sync("time");
  const inside = (selector) => frame.contentDocument && frame.contentDocument.querySelector(selector);
  // The viewer tells nobody its time; its slider has it. The mouse in a plot has the cursor first.
  const follow = () => {
    const slider = inside('[role="slider"]');
    if (slider === null) return;
    const time = start + speed * Number(slider.getAttribute("aria-valuenow"));
    frame.dataset.time = String(time);
    if (document.querySelector(".u-over:hover") !== null) return;
    for (const plot of plots) plot.setCursor({ left: plot.valToPos(time, "x"), top: 0 }, false);
  };
  const seek = (time) => {
    const input = inside('input[inputmode="decimal"]');
    if (input === null) return;
    // React listens to the input's event and looks whether the value was set behind its back.
    const { HTMLInputElement, Event } = frame.contentWindow;
    const { set } = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
    set.call(input, String((time - start) / speed));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  for (const plot of plots) {
    plot.over.addEventListener("click", (event) => seek(plot.posToVal(event.offsetX, "x")));
  }
  setInterval(follow, 40);
})();
