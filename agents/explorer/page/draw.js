// Drawing on canvases: axes, lines and the pictures of the page. Nothing is computed here.

let classes = ["black"];
// Colours of the classes, as the server names them; they come round again.
export const setClassColours = (named) => { classes = named; };
export const classColour = (k) => classes[k % classes.length];

export function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  return {
    ink: of("ink"), soft: of("soft"), line: of("line"), card: of("card"), accent: of("accent"),
    mistake: of("mistake"), shade: Number(of("shade")),
  };
}

/** The context of a canvas, cleared, one unit a CSS pixel; and its size. */
export function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  return { g, width, height };
}

const short = (v) => {
  if (v === 0) return "0";
  const size = Math.abs(v);
  if (size >= 1e6) return `${+(v / 1e6).toPrecision(3)}M`;
  if (size >= 1e4) return `${+(v / 1e3).toPrecision(3)}k`;
  return size < 0.001 ? v.toExponential(0) : `${+v.toPrecision(3)}`;
};

/** Round numbers that divide low … high into about `count` parts. */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

/** Axes in the rectangle `box`; returns the scales from data to pixels. */
function axes(g, c, box, xs, ys, labels, count = { x: 6, y: 4 }) {
  const x = (v) => box.x + ((v - xs[0]) / (xs[1] - xs[0])) * box.w;
  const y = (v) => box.y + box.h - ((v - ys[0]) / (ys[1] - ys[0])) * box.h;
  g.strokeStyle = c.line;
  g.fillStyle = c.soft;
  g.lineWidth = 1;
  g.textBaseline = "middle";
  g.textAlign = "right";
  for (const v of count.y ? ticks(ys[0], ys[1], count.y) : []) {
    line(g, [[box.x, y(v)], [box.x + box.w, y(v)]]);
    g.fillText(short(v), box.x - 5, y(v));
  }
  line(g, [[box.x, box.y + box.h], [box.x + box.w, box.y + box.h]]);
  g.textAlign = "center";
  g.textBaseline = "top";
  if (count.x) {
    for (const v of ticks(xs[0], xs[1], count.x)) g.fillText(short(v), x(v), box.y + box.h + 5);
  }
  if (labels.x) {
    g.textAlign = "right";
    g.fillText(labels.x, box.x + box.w, box.y + box.h + 19);
  }
  if (labels.y) {
    g.textAlign = "left";
    g.textBaseline = "bottom";
    g.fillText(labels.y, box.x - 34, box.y - 4);
  }
  return { x, y };
}

function line(g, points) {
  g.beginPath();
  points.forEach(([x, y], k) => (k ? g.lineTo(x, y) : g.moveTo(x, y)));
  g.stroke();
}

function shade(g, c, trial, x, top, height) {
  trial.onsets.forEach((onset, k) => {
    g.globalAlpha = c.shade;
    g.fillStyle = classColour(trial.classes[k]);
    g.fillRect(x(onset), top, x(trial.ends[k]) - x(onset), height);
    g.globalAlpha = 1;
  });
}

/** Raster, potential and teaching signal over one time axis. */
export function drawTrial(canvas, result, teaching) {
  const { g, width, height } = prepared(canvas);
  const c = colours();
  const { trial, recording } = result;
  const left = 40, right = 16, room = height - 22 - 3 * 26 - 22;
  const y0 = 22;
  const parts = teaching ? [0.42, 0.36, 0.22] : [0.5, 0.5, 0];
  const box = (k) => ({
    x: left, w: width - left - right,
    y: y0 + parts.slice(0, k).reduce((a, b) => a + b, 0) * room + k * 26, h: parts[k] * room,
  });
  const xs = [0, trial.n_bins];

  const raster = box(0);
  const top = axes(g, c, raster, xs, [0, trial.n_inputs], { y: "" }, { x: 0, y: 3 });
  shade(g, c, trial, top.x, raster.y, raster.h);
  g.fillStyle = c.ink;
  const tall = Math.max(1.6, raster.h / trial.n_inputs), wide = Math.max(1.3, raster.w / trial.n_bins);
  trial.bins.forEach((t, k) => g.fillRect(top.x(t), top.y(trial.channels[k] + 1), wide, tall));
  g.textAlign = "center";
  g.textBaseline = "bottom";
  trial.onsets.forEach((onset, k) => {
    const roomy = top.x(trial.ends[k]) - top.x(onset) > 90;
    const text = roomy ? `class ${trial.classes[k]}, owes ${trial.targets[k]}` : `${trial.classes[k]}`;
    g.fillStyle = c.ink;
    g.fillText(text, (top.x(onset) + top.x(trial.ends[k])) / 2, raster.y - 3);
  });

  const V = box(1);
  const high = 1.2 * Math.max(recording.threshold, ...recording.X);
  const low = Math.min(0, ...recording.X);
  const name = recording.graded ? "V, output S filled" : `${recording.readout}(t), spikes ▾`;
  const mid = axes(g, c, V, xs, [low, high], { y: name }, { x: 0, y: 3 });
  shade(g, c, trial, mid.x, V.y, V.h);
  g.strokeStyle = c.ink;
  g.lineWidth = 1.4;
  line(g, recording.X.map((v, t) => [mid.x(t + 0.5), mid.y(v)]));
  g.setLineDash([5, 4]);
  g.strokeStyle = c.mistake;
  line(g, [[V.x, mid.y(recording.threshold)], [V.x + V.w, mid.y(recording.threshold)]]);
  g.setLineDash([]);
  g.fillStyle = c.mistake;
  if (recording.graded) {
    recording.X.forEach((v, t) => v >= recording.threshold
      && g.fillRect(mid.x(t), mid.y(v), wide, mid.y(low) - mid.y(v)));
  }
  for (const t of recording.graded ? [] : recording.spikes) {
    const x = mid.x(t + 0.5);
    g.beginPath();
    g.moveTo(x - 5, V.y - 1);
    g.lineTo(x + 5, V.y - 1);
    g.lineTo(x, V.y + 9);
    g.fill();
  }

  const last = teaching ? box(2) : V;
  if (teaching) {
    const most = Math.max(...teaching.map(Math.abs)) || 1;
    const end = axes(g, c, last, xs, [-1.1 * most, 1.1 * most],
      { x: "time (bins)", y: "teaching signal y(t)" }, { x: 6, y: 2 });
    shade(g, c, trial, end.x, last.y, last.h);
    if (!teaching.some((v) => v)) {
      g.fillStyle = c.soft;
      g.textAlign = "center";
      g.textBaseline = "bottom";
      g.fillText("0: this trial teaches nothing", last.x + last.w / 2, end.y(0) - 4);
    }
    teaching.forEach((v, t) => {
      g.fillStyle = v > 0 ? c.accent : c.mistake;
      g.fillRect(end.x(t), Math.min(end.y(0), end.y(v)), wide, Math.abs(end.y(v) - end.y(0)));
    });
  } else {
    axes(g, c, last, xs, [low, high], { x: "time (bins)" }, { x: 6, y: 0 });
  }
}

/** Fraction of wrong trials, and that of what is kept for comparison, dashed. */
export function drawCurve(canvas, result, kept) {
  const { g, width, height } = prepared(canvas);
  const c = colours();
  const box = { x: 40, y: 22, w: width - 60, h: height - 62 };
  const all = [result, kept].filter(Boolean).map((r) => r.curve);
  const most = Math.max(1, ...all.map((curve) => curve.trials.at(-1) || 1));
  const { x, y } = axes(g, c, box, [0, most], [0, 1],
    { x: "trials", y: "share of trials answered wrongly" }, { x: 4, y: 4 });
  all.forEach((curve, k) => {
    g.setLineDash(k ? [6, 4] : []);
    g.strokeStyle = k ? c.ink : c.accent;
    g.lineWidth = 2;
    line(g, curve.trials.map((t, i) => [x(t), y(curve.wrong[i])]));
  });
  g.setLineDash([]);
}

/** A bar for each weight, the initial ones as grey ticks. */
export function drawWeights(canvas, result) {
  const { g, width, height } = prepared(canvas);
  const c = colours();
  const { initial, learned } = result.weights;
  const box = { x: 40, y: 22, w: width - 60, h: height - 62 };
  const high = Math.max(1e-9, ...learned, ...initial), low = Math.min(0, ...learned, ...initial);
  const { x, y } = axes(g, c, box, [0, learned.length], [low, 1.05 * high],
    { x: "input channel", y: "weight" }, { x: 5, y: 4 });
  const wide = Math.max(1, (box.w / learned.length) * 0.75);
  learned.forEach((w, i) => {
    g.fillStyle = c.accent;
    g.fillRect(x(i), Math.min(y(w), y(0)), wide, Math.abs(y(w) - y(0)));
    g.fillStyle = c.ink;
    g.fillRect(x(i), y(initial[i]) - 0.75, wide, 1.5);
  });
}

/** The last bins of a game; the newest on the right. */
export function drawGame(canvas, bins, n_inputs, help) {
  const { g, width, height } = prepared(canvas);
  const c = colours();
  const shown = Math.floor(width / 5), step = width / shown;
  const rasterHeight = height - 70;
  const part = bins.slice(-shown);
  part.forEach((bin, k) => {
    const x = width - (part.length - k) * step;
    if (bin.class >= 0 && (help || bin.past)) {
      g.globalAlpha = c.shade;
      g.fillStyle = classColour(bin.class);
      g.fillRect(x, 0, step + 0.5, height);
      g.globalAlpha = 1;
    }
    g.fillStyle = c.ink;
    const tall = Math.max(2, rasterHeight / n_inputs);
    for (const channel of bin.channels) {
      g.fillRect(x, rasterHeight - ((channel + 1) / n_inputs) * rasterHeight, Math.max(2, step - 1), tall);
    }
    if (bin.spike) {
      g.fillStyle = c.mistake;
      g.fillRect(x, rasterHeight + 8, step, 22);
    }
    if (bin.neuron) {
      g.fillStyle = c.accent;
      g.fillRect(x, rasterHeight + 42, step, 22);
    }
  });
  g.fillStyle = c.soft;
  g.textBaseline = "top";
  g.textAlign = "left";
  g.fillText("you", 4, rasterHeight + 12);
  g.fillText("the neuron", 4, rasterHeight + 46);
  g.strokeStyle = c.line;
  line(g, [[0, rasterHeight + 4], [width, rasterHeight + 4]]);
  line(g, [[0, rasterHeight + 36], [width, rasterHeight + 36]]);
}

/** All pictures and what they show, in one, as a PNG. */
export function wholePicture(canvases, heading) {
  const ratio = window.devicePixelRatio || 1;
  const c = colours();
  const margin = 16 * ratio;
  const rows = [[canvases.trial], [canvases.curve, canvases.weights]];
  const stacked = canvases.curve.offsetLeft === canvases.weights.offsetLeft;
  const lines = stacked ? rows.flat().map((one) => [one]) : rows;
  const width = canvases.trial.width + 2 * margin;
  const heights = lines.map((row) => Math.max(...row.map((one) => one.height)));
  const whole = document.createElement("canvas");
  whole.width = width;
  const head = 22 * ratio * heading.length + margin;
  whole.height = head + heights.reduce((a, b) => a + b + margin, margin);
  const g = whole.getContext("2d");
  g.fillStyle = c.card;
  g.fillRect(0, 0, whole.width, whole.height);
  g.fillStyle = c.ink;
  g.textBaseline = "top";
  heading.forEach((text, k) => {
    g.font = `${k ? 13 * ratio : 16 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    g.fillText(text, margin, margin + 22 * ratio * k, width - 2 * margin);
  });
  let y = head + margin;
  lines.forEach((row, k) => {
    const room = (width - 2 * margin) / row.length;
    row.forEach((one, i) => g.drawImage(one, margin + i * room, y));
    y += heights[k] + margin;
  });
  return whole;
}
