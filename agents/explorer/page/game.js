// Beat the neuron: the server plays the environment, the page shows bins and sends presses.

import { drawGame } from "/page/draw.js";

const $ = (id) => document.getElementById(id);
const MISTAKES = {
  noise: "a spike in noise", "too many": "one spike too many", "too few": "a pattern owed more spikes",
};
let socket = null, bins = [], inputs = 100, score = null, dirty = false;

const number = (n) => Math.round(n).toLocaleString("en");

export function openGame(link, nInputs) {
  inputs = nInputs;
  bins = [];
  $("game").showModal();
  $("game-status").textContent = "";
  redraw();
  $("begin").onclick = () => begin(link());
  $("begin").focus();
}

function begin(settings) {
  stop();
  bins = [];
  score = null;
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/api/play`);
  socket.onopen = () => socket.send(JSON.stringify({
    begin: settings, speed: Number($("speed").value), seed: Number($("stream").value),
  }));
  socket.onmessage = (event) => heard(JSON.parse(event.data));
  $("game-status").textContent = "Preparing …";
  $("game-canvas").focus();
}

function heard(said) {
  if (said.error) {
    $("game-status").textContent = said.error;
  } else if (said.begun) {
    score = said;
    const owed = said.owed.map((n, k) => `class ${k}: ${n}`).join(", ");
    $("game-status").textContent = `Owed: ${owed}. Space spikes.`;
  } else if ("channels" in said) {
    const before = bins.at(-1);
    if (before && before.class >= 0 && said.class !== before.class) reveal();
    bins.push({ ...said, spike: 0, past: false });
    if (bins.length > 2000) bins.splice(0, 1000);
  } else {
    bins.at(-1).spike = said.spike;
    if (said.over) end(said);
  }
  if (!dirty) {
    dirty = true;
    requestAnimationFrame(() => { dirty = false; redraw(); });
  }
}

/** What a pattern was is shown once it is over. */
function reveal() {
  for (let k = bins.length - 1; k >= 0 && bins[k].class >= 0; k--) bins[k].past = true;
}

function end(said) {
  reveal();
  const best = Math.max(said.survived, Number(localStorage.getItem("best") || 0));
  localStorage.setItem("best", best);
  const why = said.mistake ? `: ${MISTAKES[said.mistake]}` : "";
  const verdict = said.survived > score.neuron_score ? "You beat the neuron." : "The neuron wins.";
  const silence = score.silent === null ? "" : ` Silence gets ${number(score.silent)} on average.`;
  $("game-status").textContent = `${number(said.survived)} bins${why}. The neuron survives `
    + `${number(score.neuron_score)} on this stream. ${verdict}${silence} Your best: ${number(best)}.`;
  stop();
  $("begin").focus();
}

function redraw() {
  if ($("game").open) drawGame($("game-canvas"), bins, inputs, $("help").checked);
}

function press() {
  if (socket?.readyState === WebSocket.OPEN && bins.length) socket.send("{}");
}

function stop() {
  if (socket) {
    socket.onmessage = null;
    socket.close();
  }
  socket = null;
}

$("game").addEventListener("keydown", (event) => {
  if (event.code === "Space" && !["BUTTON", "INPUT"].includes(event.target.tagName)) {
    event.preventDefault();
    if (!event.repeat) press();
  }
});
$("game-canvas").addEventListener("pointerdown", press);
$("help").addEventListener("change", redraw);
$("leave").addEventListener("click", () => $("game").close());
$("game").addEventListener("close", stop);
window.addEventListener("resize", redraw);
