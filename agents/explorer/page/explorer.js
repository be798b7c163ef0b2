// The page: settings to a link, the link to the server, its answer to pictures.

import { drawCurve, drawTrial, drawWeights, setClassColours, wholePicture } from "/page/draw.js";
import { openGame } from "/page/game.js";

const $ = (id) => document.getElementById(id);
const PATIENCE = 1500; // ms after which a training that is no longer wanted is given up
const number = (n, digits = 0) => n.toLocaleString("en", { maximumFractionDigits: digits });

let schema = null;
let state = {}; // what differs from the defaults: the link
let versus = null; // the link of what is kept for comparison, and its result
let result = null, teaching = null;

// --- settings and link ---------------------------------------------------------------------------

const model = () => schema.models.find((one) => one.name === (state.neuron ?? "gnm"));
const rule = () => schema.rules.find((one) => one.name === (state.rule ?? model().rule));
const value = (control) => state[control.key] ?? text(control.default);
const text = (given) => given === null ? "none" : given === true ? "1" : given === false ? "0" : `${given}`;

/** Bounds of the weights, "none" or "low,high". */
const bounds = () => state.bounds ?? (!model().bounded || state["n.readout"] === "D" ? "none" : "0,1");

function link() {
  return new URLSearchParams(state).toString();
}

function readAddress() {
  const given = Object.fromEntries(new URLSearchParams(location.search));
  const other = given.versus;
  delete given.versus;
  state = given;
  versus = other ? { link: other, result: null } : null;
}

function writeAddress() {
  const query = new URLSearchParams(state);
  if (versus) query.set("versus", versus.link);
  const now = `${location.pathname}${query.size ? "?" : ""}${query}`;
  if (now !== location.pathname + location.search) history.replaceState(null, "", now);
  $("checkpoint").href = `/agent.npz?${link()}`;
}

/** Change a setting; what equals the default is left out of the link. */
function set(key, given, standard) {
  if (given === text(standard)) delete state[key];
  else state[key] = given;
  run();
}

function forget(prefix) {
  for (const key of Object.keys(state)) if (key.startsWith(prefix)) delete state[key];
}

// --- controls ------------------------------------------------------------------------------------

function row(name, symbol, help) {
  const label = document.createElement("label");
  label.className = "row";
  label.title = help || "";
  const span = label.appendChild(document.createElement("span"));
  if (symbol) {
    const [main, index] = symbol.split("_");
    const em = span.appendChild(document.createElement("em"));
    em.textContent = main;
    if (index) em.appendChild(document.createElement("sub")).textContent = index;
  }
  span.append(name);
  return label;
}

function field(type, label, className = "") {
  const input = label.appendChild(document.createElement("input"));
  input.type = type;
  input.className = className;
  return input;
}

/** A number: a slider where a range is known, and a box beside it that takes any number. */
function numberRow(control) {
  const label = row(control.name, control.symbol, control.help);
  const { low, high, log, whole } = control;
  const toValue = (p) => {
    const v = log ? low * (high / low) ** (p / 1000) : low + ((high - low) * p) / 1000;
    return whole ? `${Math.round(v)}` : `${+v.toPrecision(3)}`;
  };
  const toPlace = (v) => 1000 * (log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low));
  let slider = null;
  if (low !== undefined) {
    slider = field("range", label);
    slider.min = 0;
    slider.max = 1000;
    slider.step = whole && !log ? 1000 / (high - low) : 1;
    slider.setAttribute("aria-label", `${control.name}, slider`);
  }
  const box = field("number", label, slider ? "" : "lone");
  box.step = "any";
  if (control.optional) box.placeholder = "none";
  box.dataset.key = control.key;
  const show = (v) => {
    box.value = v === "none" ? "" : v;
    if (slider) slider.value = toPlace(Number(v));
  };
  show(value(control));
  if (slider) {
    slider.dataset.key = control.key;
    slider.addEventListener("input", () => {
      const v = toValue(Number(slider.value));
      box.value = v;
      control.set(v);
    });
  }
  box.addEventListener("input", () => {
    const v = box.value === "" ? (control.optional ? "none" : null) : box.value;
    if (v === null) return;
    if (slider && v !== "none") slider.value = toPlace(Number(v));
    control.set(v);
  });
  return label;
}

function otherRow(control) {
  const label = row(control.name, control.symbol, control.help);
  if (control.kind === "switch") {
    label.classList.add("switch");
    const box = field("checkbox", label);
    box.checked = value(control) === "1";
    box.addEventListener("change", () => control.set(box.checked ? "1" : "0"));
  } else if (control.kind === "choice") {
    const select = label.appendChild(document.createElement("select"));
    for (const option of control.options) select.add(new Option(option));
    select.value = value(control);
    select.addEventListener("change", () => control.set(select.value));
  } else {
    const box = field("text", label, "wide");
    box.placeholder = "numbers, or empty";
    box.value = value(control) === "none" ? "" : value(control);
    box.addEventListener("change", () => control.set(box.value.trim() || "none"));
  }
  label.lastChild.dataset.key = control.key;
  return label;
}

function fill(place, controls) {
  place.replaceChildren();
  const rest = document.createElement("details");
  rest.appendChild(document.createElement("summary")).textContent = "more";
  for (const control of controls) {
    control.set ??= (v) => set(control.key, v, control.default);
    const made = control.kind === "number" ? numberRow(control) : otherRow(control);
    (control.first ? place : rest).append(made);
    if (!control.first && control.key in state) rest.open = true;
  }
  if (rest.children.length > 1) place.append(rest);
}

function weightControls() {
  const initial = model().initial_weight;
  const bounded = bounds() !== "none";
  const [low, high] = bounded ? bounds().split(",").map(Number) : [0, 1];
  const part = (key, name, now, least, most, put) => ({
    kind: "number", key, name, symbol: "", default: now, low: least, high: most, log: false,
    whole: false, first: true, set: put, help: "",
  });
  const both = (a, b) => { state.bounds = `${a},${b}`; run(); };
  const now = () => bounds().split(",");
  const controls = [{
    kind: "number", key: "initial_weight", name: "initial", symbol: "w₀", default: initial, low: 0,
    high: 1, log: false, whole: false, first: true,
    help: "Initial weights are uniform on 0 … w₀.",
  }];
  if (model().bounded) {
    controls.push({
      kind: "switch", key: "bounded", name: "bounded", symbol: "", default: bounded, first: true,
      help: "Whether weights are held between two bounds.",
      set: (v) => { state.bounds = v === "1" ? "0,1" : "none"; rebuild(); run(); },
    });
    if (bounded) {
      controls.push(part("lowest", "lowest", low, -1, 1, (v) => both(v, now()[1])));
      controls.push(part("highest", "highest", high, 0, 2, (v) => both(now()[0], v)));
    }
  }
  fill($("weight-controls"), controls);
}

function trainingControls() {
  const of = (key, name, standard, low, high, log, help) => ({
    kind: "number", key, name, symbol: "", default: standard, low, high, log, whole: true,
    first: true, help,
  });
  fill($("training-controls"), [
    of("trials", "trials", schema.trials, 1000, 1_000_000, true, "Trials that it learns from."),
    of("pattern_seed", "pattern seed", 0, 0, 50, false, "Which patterns are hidden."),
    of("seed", "seed", 0, 0, 50, false, "Of the stream and of the initial weights."),
  ]);
}

function rebuild() {
  const chosen = model();
  $("neuron").value = chosen.name;
  $("neuron").title = chosen.about;
  $("rule").replaceChildren(...chosen.rules.map((name) => {
    const one = schema.rules.find((known) => known.name === name);
    return new Option(`${one.title} (${name})`, name);
  }));
  $("rule").value = rule().name;
  $("rule").title = rule().about;
  $("mute").checked = state.mute === "1";
  fill($("model-controls"), chosen.controls);
  fill($("rule-controls"), rule().controls);
  fill($("task-controls"), schema.task);
  weightControls();
  trainingControls();
}

// --- asking the server ---------------------------------------------------------------------------

async function ask(path, query, signal) {
  const answer = await fetch(`${path}?${query}`, { signal });
  const found = await answer.json();
  if (!answer.ok) throw new Error(found.error ?? answer.statusText);
  return found;
}

let flight = null; // the request under way: its start, and how to give it up
let moved = 0; // when a setting was last changed and not yet answered; 0: all is answered

function run() {
  moved ||= performance.now();
  if (flight) {
    flight.stale = true;
    if (performance.now() - flight.began > PATIENCE) flight.abort.abort();
    return;
  }
  answerTo(link());
}

async function answerTo(query) {
  const asked = moved;
  moved = 0;
  flight = { began: performance.now(), abort: new AbortController(), stale: false };
  const waiting = setTimeout(() => {
    document.body.classList.add("busy");
    say("Training … (a combination that is new to this machine is compiled first, once)");
  }, 1000);
  try {
    await compute(query, flight.abort.signal);
    performance.measure("redraw", { start: asked, end: performance.now() });
  } catch (error) {
    if (error.name !== "AbortError") say(error.message, true);
  }
  clearTimeout(waiting);
  document.body.classList.remove("busy");
  const again = flight.stale;
  flight = null;
  writeAddress();
  if (again) answerTo(link());
}

async function compute(query, signal) {
  const later = ask("/api/teaching", query, signal).catch(() => ({ y: null }));
  const found = await ask("/api/result", query, signal);
  // The teaching signal comes at once, unless it has to be compiled.
  const soon = await Promise.race([later, new Promise((done) => setTimeout(done, 250, null))]);
  result = found;
  teaching = soon?.y ?? null;
  if (versus && !versus.result) {
    versus.result = await ask("/api/result", versus.link, signal);
  }
  show();
  if (!soon) {
    later.then(({ y }) => {
      if (result === found) {
        teaching = y;
        draw();
      }
    });
  }
}

// --- showing the answer --------------------------------------------------------------------------

const STATES = {
  alive: "",
  silent: " It never spikes: V stays below the threshold.",
  above: " V stays above the threshold, and only an upward crossing is a spike.",
};

function say(message, wrong = false) {
  $("status").textContent = message;
  $("status").classList.toggle("error", wrong);
}

function show() {
  const { score } = result;
  const { mean, cap } = score.noisy_performance;
  const place = (bins) => `${(100 * Math.log1p(Math.min(bins, cap))) / Math.log1p(cap)}%`;
  $("performance").textContent = number(mean);
  $("bar").style.width = place(mean);
  const silent = score.silent_score;
  $("silent").textContent = silent === null ? "∞" : number(silent);
  $("silent-mark").style.left = silent === null ? "100%" : place(silent);
  const [low, high] = score.mistakes_per_10000_bins_ci95;
  $("mistakes").textContent = `${number(score.mistakes_per_10000_bins, 2)} `
    + `(${number(low, 2)} … ${number(high, 2)})`
    + (score.silent_mistakes_per_10000_bins === null
      ? "" : `, silence ${number(score.silent_mistakes_per_10000_bins, 1)}`);
  $("wrong").textContent = `${number(100 * score.error_rate, 1)} %`;
  const kept = versus?.result;
  $("versus-row").hidden = $("versus-mark").hidden = $("drop").hidden = !kept;
  if (kept) {
    $("versus").textContent = number(kept.score.noisy_performance.mean);
    $("versus-mark").style.left = place(kept.score.noisy_performance.mean);
  }
  const { runs } = score.noisy_performance;
  const overflow = result.overflowed < 0 ? ""
    : ` A weight would have overflowed in trial ${number(result.overflowed + 1)}: learning ended.`;
  const muted = state.mute === "1" ? " The label was muted." : "";
  say(`${number(result.curve.trials.at(-1) ?? 0)} trials learned and scored on ${runs} streams in `
    + `${result.seconds.toFixed(2)} s.${muted}${STATES[result.state]}${overflow}`);
  answers(score.answers);
  draw();
}

function answers({ owed, spikes_given, false_positives_per_1000_noise_bins }) {
  const totals = spikes_given.map((counts) => counts.reduce((a, b) => a + b, 0) || 1);
  const last = spikes_given[0].length - 1;
  const used = (k) => spikes_given.some((counts) => counts[k] > 0) || owed.some((n) => n >= k);
  const most = Math.max(1, ...[...Array(last + 1).keys()].filter(used));
  const head = ["class", "owed", ...Array(most + 1).keys()]
    .map((one) => `<th scope="col">${one === last ? `${one}+` : one}</th>`).join("");
  const rows = spikes_given.map((counts, k) => {
    const cells = counts.slice(0, most + 1).map((count, spikes) => {
      const share = count / totals[k];
      const shade = `data-share="${share.toFixed(3)}"`;
      return `<td ${shade} class="${spikes === owed[k] ? "owed" : ""}">${(100 * share).toFixed(1)}</td>`;
    }).join("");
    return `<tr><th scope="row">${k}</th><th>${owed[k]}</th>${cells}</tr>`;
  }).join("");
  $("answers").innerHTML = `<thead><tr>${head}</tr></thead><tbody>${rows}</tbody>`;
  for (const cell of $("answers").querySelectorAll("td")) {
    cell.style.background = `color-mix(in srgb, var(--accent) ${45 * cell.dataset.share}%, transparent)`;
  }
  $("false-positives").textContent =
    `False positives: ${number(false_positives_per_1000_noise_bins, 2)} per 1,000 bins of noise.`;
}

function draw() {
  if (!result) return;
  drawTrial($("trial"), result, teaching);
  drawCurve($("curve"), result, versus?.result);
  drawWeights($("weights"), result);
  const { recording, trial } = result;
  const given = recording.graded ? "" : `, ${recording.spikes.length} spikes given`;
  $("trial-text").textContent = `${trial.n_bins} bins, owed ${trial.label}${given}`;
  $("trial").setAttribute("aria-label", `A trial of ${trial.n_bins} bins with ${trial.onsets.length} `
    + `patterns: owed ${trial.label}${given}; highest V ${number(Math.max(...recording.X), 2)}, `
    + `threshold ${recording.threshold}`);
  const wrong = result.curve.wrong;
  $("curve").setAttribute("aria-label", wrong.length
    ? `Trials answered wrongly: ${number(100 * wrong[0], 1)} % at first, `
      + `${number(100 * wrong.at(-1), 1)} % in the end` : "No learning curve");
  $("weights").setAttribute("aria-label", `${result.weights.learned.length} weights from `
    + `${number(Math.min(...result.weights.learned), 3)} to `
    + `${number(Math.max(...result.weights.learned), 3)}`);
}

// --- buttons -------------------------------------------------------------------------------------

function follow(query, other = null, notice = "") {
  state = Object.fromEntries(new URLSearchParams(query));
  versus = other === null || other === "" ? null : { link: other, result: null };
  $("notice").textContent = notice;
  rebuild();
  run();
}

function wire() {
  for (const one of schema.models) $("neuron").add(new Option(`${one.title} (${one.name})`, one.name));
  $("neuron").addEventListener("change", () => {
    for (const prefix of ["n.", "r.", "rule", "bounds", "initial_weight"]) forget(prefix);
    if ($("neuron").value === "gnm") delete state.neuron;
    else state.neuron = $("neuron").value;
    rebuild();
    run();
  });
  $("rule").addEventListener("change", () => {
    forget("r.");
    if ($("rule").value === model().rule) delete state.rule;
    else state.rule = $("rule").value;
    rebuild();
    run();
  });
  $("mute").addEventListener("change", () => set("mute", $("mute").checked ? "1" : "0", false));
  setClassColours(schema.class_colours);
  schema.presets.forEach((one, k) => $("presets").add(new Option(one.title, k)));
  $("presets").addEventListener("change", () => {
    const one = schema.presets[$("presets").value];
    if (one) follow(one.link, one.versus, one.notice);
  });
  $("another").addEventListener("click", () => set("shown", `${Number(state.shown ?? 7) + 1}`, 7));
  $("keep").addEventListener("click", () => {
    versus = { link: link(), result };
    writeAddress();
    show();
  });
  $("drop").addEventListener("click", () => {
    versus = null;
    writeAddress();
    show();
  });
  $("reset").addEventListener("click", () => {
    $("presets").value = "";
    follow("");
  });
  $("copy").addEventListener("click", async () => {
    writeAddress();
    await navigator.clipboard.writeText(location.href);
    say("The link is in the clipboard: it reproduces what you see, trained anew.");
  });
  $("picture").addEventListener("click", () => savePicture());
  $("play").addEventListener("click", () => openGame(() => ({ ...state }), result?.trial.n_inputs ?? 100));
  $("theme").addEventListener("click", () => {
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const now = document.documentElement.dataset.theme ?? (dark ? "dark" : "light");
    theme(now === "dark" ? "light" : "dark");
  });
  $("controls").addEventListener("submit", (event) => event.preventDefault());
  window.addEventListener("popstate", () => { readAddress(); rebuild(); run(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new ResizeObserver(draw).observe($("trial-figure"));
}

function theme(name) {
  document.documentElement.dataset.theme = name;
  localStorage.setItem("theme", name);
  draw();
}

function savePicture() {
  const heading = [
    `${model().title}, ${rule().title}: ${$("performance").textContent} bins survived, `
      + `silence ${$("silent").textContent}`,
    location.search ? decodeURIComponent(location.search.slice(1)) : "defaults",
  ];
  const canvases = { trial: $("trial"), curve: $("curve"), weights: $("weights") };
  wholePicture(canvases, heading).toBlob((blob) => {
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = "explorer.png";
    anchor.click();
    URL.revokeObjectURL(anchor.href);
  });
}

async function start() {
  const kept = localStorage.getItem("theme");
  if (kept) document.documentElement.dataset.theme = kept;
  readAddress();
  moved = performance.now();
  try {
    schema = await ask("/api/schema", "");
    wire();
    rebuild();
  } catch (error) {
    say(`The page cannot begin: ${error.message}`, true);
    return;
  }
  run();
}

start();
