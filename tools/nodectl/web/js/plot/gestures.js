// Zoom and pause by mouse, finger and keys.

const KEYS = {
  "+": (time) => time.zoom(0.5),
  "-": (time) => time.zoom(2),
  " ": (time) => time.toggle(),
  ArrowLeft: (time) => time.move(-0.25),
  ArrowRight: (time) => time.move(0.25),
  Home: (time) => time.follow(),
};

export function addGestures(chart, time) {
  const { canvas } = chart;
  canvas.addEventListener("keydown", (event) => {
    const act = KEYS[event.key];
    if (!act) return;
    act(time);
    event.preventDefault();
  });
  canvas.addEventListener("wheel", (event) => zoomByWheel(event, chart, time), { passive: false });
  canvas.addEventListener("dblclick", () => time.follow());
  canvas.addEventListener("pointermove", (event) => time.point(chart.share(event)));
  canvas.addEventListener("pointerleave", () => time.point(null));
  addDrag(chart, time);
}

/** The wheel zooms only while Ctrl is held or the plot has the focus, so that a page can still be scrolled past a plot. */
function zoomByWheel(event, chart, time) {
  if (!event.ctrlKey && document.activeElement !== chart.canvas) return;
  event.preventDefault();
  time.zoom(event.deltaY > 0 ? 1.25 : 0.8, chart.share(event));
}

/** Dragging with a mouse chooses the time that the plots show. */
function addDrag(chart, time) {
  let start = null;
  chart.canvas.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && event.button === 0) start = { share: chart.share(event), from: time.from };
  });
  chart.canvas.addEventListener("pointerup", (event) => {
    if (!start) return;
    const [a, b] = [start.share, chart.share(event)].sort((x, y) => x - y);
    if (b - a > 0.02) time.show(start.from + a * time.length, start.from + b * time.length);
    start = null;
  });
}
