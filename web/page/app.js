// The page: workers, what the reader chooses, both pictures and their errors.
import { readHdr, sky, studio } from "./maps.js";
import { NAMES, luminance, plot, score } from "./score.js";

const $ = (id) => document.getElementById(id);
const METRICS = ["relative", "absolute"];
const CANDIDATES = [0, 1, 2, 4, 8, 16, 32, 64];
// Milliseconds of the first point of the plots.
const FIRST_POINT = 60;
const state = { generation: 0, azimuth: 0, tilt: 0, map: null, workers: [], module: null, sums: [], points: [] };

function choice() {
  const wide = matchMedia("(min-width: 700px)").matches;
  const width = Math.min(wide ? 384 : 240, Math.round($("mis").clientWidth * devicePixelRatio));
  return {
    azimuth: state.azimuth, tilt: state.tilt, width, height: wide ? Math.round(width * 0.75) : width,
    material: Number(document.querySelector("input[name=material]:checked").value),
    roughness: Number($("roughness").value), rays: Number($("rays").value),
    candidates: CANDIDATES[$("candidates").value], bounces: Number($("bounces").value),
    budget: 1000 * Number($("seconds").value),
  };
}

// Begins anew with what is chosen.
function restart() {
  state.settings = choice();
  const { width, height } = state.settings;
  Object.assign(state, { generation: state.generation + 1, points: [] });
  state.pictures = [0, 1, 2, 3].map(() => ({ sums: new Float32Array(3 * width * height), samples: new Float32Array(height), times: state.workers.map(() => 0) }));
  for (const worker of state.workers) worker.postMessage({ settings: state.settings, generation: state.generation });
  for (const name of NAMES) {
    Object.assign($(name), { width, height });
    for (const metric of METRICS) $(`${name}-${metric}`).textContent = "…";
  }
  $("roughness-value").textContent = $("roughness").value;
  $("roughness").disabled = state.settings.material === 2;
  $("rays-value").textContent = $("rays").value;
  $("candidates-value").textContent = state.settings.candidates || "automatic";
  $("bounces-value").textContent = $("bounces").value;
  $("seconds-value").textContent = `${$("seconds").value} s`;
  $("turn").value = ((state.azimuth * 180) / Math.PI + 720) % 360;
  $("turn-value").textContent = `${Math.round($("turn").value)}°`;
}

// Gives each worker a map; they have no more in common than that.
function openMap(map, name) {
  const compensated = $("compensated").checked;
  Object.assign(state, { map, name });
  let [light, area] = [0, 0];
  for (let y = 0; y < map.height; y++) {
    const sine = Math.sin((Math.PI * (y + 0.5)) / map.height);
    for (let x = 0; x < map.width; x++) light += sine * Math.min(1e6, luminance(map.texels, y * map.width + x));
    area += sine * map.width;
  }
  state.mean = light / area || 1;
  $("status").textContent = `${name}: ${map.width} × ${map.height} texels, ${state.workers.length} workers`;
  for (const [first, worker] of state.workers.entries()) {
    worker.postMessage({ module: state.module, map, first, step: state.workers.length, compensated });
  }
  restart();
}

function receive({ data }) {
  if (data.generation !== state.generation) return;
  const picture = state.pictures[data.picture], { width, height } = state.settings;
  for (let y = data.first, i = 0; y < height; y += data.step, i++) {
    picture.sums.set(data.sums.subarray(3 * width * i, 3 * width * (i + 1)), 3 * width * y);
    picture.samples[y] = data.samples;
  }
  picture.times[data.first] = data.time;
  picture.changed = true;
  if (!state.drawing) state.drawing = requestAnimationFrame(draw);
}

// Exposure, a filmic curve (Narkowicz 2015) and the gamma of sRGB.
function tone(x) {
  const film = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
  return 255 * Math.min(1, film) ** (1 / 2.2);
}

function luminances(picture) {
  const { width, height } = state.settings, out = new Float32Array(width * height);
  for (let i = 0; i < out.length; i++) out[i] = luminance(picture.sums, i) / picture.samples[Math.floor(i / width)];
  return out;
}

function draw() {
  state.drawing = 0;
  const { width, height } = state.settings, exposure = (0.5 * 2 ** Number($("exposure").value)) / state.mean;
  for (const [k, name] of NAMES.entries()) {
    const picture = state.pictures[k];
    if (!picture.changed) continue;
    picture.changed = false;
    const image = new ImageData(width, height);
    for (let i = 0; i < width * height; i++) {
      const scale = exposure / Math.max(1, picture.samples[Math.floor(i / width)]);
      for (let c = 0; c < 3; c++) image.data[4 * i + c] = tone(picture.sums[3 * i + c] * scale);
      image.data[4 * i + 3] = 255;
    }
    $(name).getContext("2d").putImageData(image, 0, 0);
  }
  remember();
  state.timer ??= setTimeout(show, 300);
}

const mean = (numbers) => numbers.reduce((sum, x) => sum + x, 0) / numbers.length;
const complete = (picture) => picture.samples.every((n) => n > 0);

// Keeps both pictures whenever their time has grown by a half, to score them again as the references become better.
function remember() {
  const pictures = state.pictures.slice(0, 2), time = Math.min(...pictures.flatMap((p) => p.times));
  const last = state.points.at(-1);
  if (!pictures.every(complete) || time < (last ? 1.5 * last.time : FIRST_POINT)) return;
  state.points.push({ time, pictures: pictures.map(luminances) });
}

const digits = (x) => (x > 0 ? (x < 0.001 ? x.toExponential(1) : x.toPrecision(2)) : "…");

function show() {
  state.timer = undefined;
  const [a, b] = state.pictures.slice(2);
  const both = state.pictures.slice(0, 2);
  for (const [k, name] of NAMES.entries()) {
    const samples = mean([...both[k].samples]), seconds = mean(both[k].times) / 1000;
    $(`${name}-samples`).textContent = `${samples.toFixed(samples < 10 ? 1 : 0)} samples in ${seconds.toFixed(1)} s`;
  }
  if (![...both, a, b].every(complete)) return;
  const references = [luminances(a), luminances(b)];
  const now = both.map((picture) => score(luminances(picture), ...references));
  for (const [k, name] of NAMES.entries()) {
    for (const metric of METRICS) $(`${name}-${metric}`).textContent = digits(now[k][metric]);
  }
  for (const point of state.points) NAMES.forEach((name, k) => (point[name] = score(point.pictures[k], ...references)));
  for (const metric of METRICS) $(`plot-${metric}`).innerHTML = plot(state.points, metric);
  // A pass may end late, so what counts is error x time.
  const gain = (metric) => {
    const [mis, wis] = both.map((picture, k) => now[k][metric] * mean(picture.times)), ratio = mis / wis;
    if (!(ratio > 0 && Number.isFinite(ratio))) return `the ${metric} error is not known yet`;
    return `${ratio > 1 ? "wis" : "MIS"} has ${Math.max(ratio, 1 / ratio).toFixed(2)}x lower ${metric} error`;
  };
  $("verdict").textContent = `At equal time, ${METRICS.map(gain).join(", and ")}.`;
  const share = Math.min(1, mean([...a.times, ...b.times]) / (8 * state.settings.budget));
  const samples = Math.round(mean([...a.samples]) + mean([...b.samples]));
  $("reference").textContent = share < 1 ? `Reference: ${samples} samples, ${Math.round(100 * share)} %` : `Reference: ${samples} samples, done`;
  document.documentElement.dataset.reference = share;
}

async function openFile(file) {
  try {
    openMap(readHdr(await file.arrayBuffer()), file.name);
    $("map").value = "file";
  } catch (error) {
    $("status").textContent = `${file.name}: ${error.message}`;
  }
}

function listen() {
  const maps = { studio: [studio, "Studio"], sky: [sky, "Sky"] };
  $("map").onchange = () => ($("map").value === "file" ? $("file").click() : openMap(maps[$("map").value][0](), maps[$("map").value][1]));
  $("file").onchange = () => $("file").files[0] && openFile($("file").files[0]);
  $("compensated").onchange = () => openMap(state.map, state.name);
  $("exposure").oninput = () => {
    state.pictures.forEach((picture) => (picture.changed = true));
    $("exposure-value").textContent = `${$("exposure").value} EV`;
    draw();
  };
  for (const input of document.querySelectorAll(".restarts input")) input.oninput = restart;
  $("turn").oninput = () => ((state.azimuth = (Number($("turn").value) * Math.PI) / 180), restart());
  for (const name of NAMES) {
    let last;
    $(name).onpointerdown = (event) => ((last = event), $(name).setPointerCapture(event.pointerId));
    $(name).onpointermove = (event) => {
      if (!$(name).hasPointerCapture(event.pointerId)) return;
      state.azimuth += (event.clientX - last.clientX) * 0.012;
      // A finger that moves up or down scrolls the page.
      if (event.pointerType === "mouse") state.tilt = Math.max(-1, Math.min(1, state.tilt + (event.clientY - last.clientY) * 0.008));
      last = event;
      restart();
    };
  }
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) openFile(event.dataTransfer.files[0]);
  });
  let timer;
  addEventListener("resize", () => (clearTimeout(timer), (timer = setTimeout(() => $("mis").width !== choice().width && restart(), 200))));
}

// `wasm` and `workerSource` are put into the page when it is built.
export async function start(wasm, workerSource) {
  const bytes = Uint8Array.from(atob(wasm), (c) => c.charCodeAt(0));
  state.module = await WebAssembly.compile(bytes);
  const source = URL.createObjectURL(new Blob([workerSource], { type: "text/javascript" }));
  const count = Math.max(1, Math.min(8, navigator.hardwareConcurrency || 2));
  for (let i = 0; i < count; i++) {
    const worker = new Worker(source);
    worker.onmessage = receive;
    worker.onerror = (event) => ($("status").textContent = event.message);
    state.workers.push(worker);
  }
  listen();
  openMap(studio(), "Studio");
}
