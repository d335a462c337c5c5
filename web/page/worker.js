// A worker: renders its rows of four pictures (MIS, wis, and a reference by each), whichever is behind in time.
let wasm, tracer, settings, generation, samples, times;

// Milliseconds of a pass at the most, so that a new setting is seen soon.
const PASS = 120;

function open({ module, map, first, step, compensated }) {
  wasm = new WebAssembly.Instance(module, {}).exports;
  tracer = wasm.tracer_new(map.width, map.height);
  new Float32Array(wasm.memory.buffer, wasm.tracer_texels(tracer), map.texels.length).set(map.texels);
  if (!wasm.tracer_build(tracer, compensated ? 1 : 0)) throw new Error("The light of this map could not be built.");
  Object.assign(tracerRows, { first, step });
}
const tracerRows = { first: 0, step: 1 };

function begin(message) {
  ({ settings, generation } = message);
  [samples, times] = [[0, 0, 0, 0], [0, 0, 0, 0]];
  wasm.tracer_turn(tracer, settings.azimuth, settings.tilt);
  wasm.tracer_material(tracer, settings.material, settings.roughness);
  wasm.tracer_effort(tracer, settings.rays, settings.candidates, settings.bounces);
  wasm.tracer_begin(tracer, settings.width, settings.height, tracerRows.first, tracerRows.step);
}

// The picture that is to get samples next: references have as much time as both pictures, and then eight times as much; -1: done.
function next() {
  const [mis, wis, a, b] = times, behind = mis <= wis ? 0 : 1, reference = a <= b ? 2 : 3;
  if (times[behind] >= settings.budget) return a + b < 16 * settings.budget ? reference : -1;
  return samples[0] > 1 && a + b < mis + wis ? reference : behind;
}

function work() {
  const picture = settings ? next() : -1;
  if (picture < 0) return;
  const each = times[picture] / Math.max(1, samples[picture]);
  const room = picture < 2 ? Math.max(0, settings.budget - times[picture]) : Infinity;
  const count = Math.max(1, Math.min(16, samples[picture], Math.floor(Math.min(PASS, room) / each)));
  const start = performance.now();
  const sums = wasm.tracer_render(tracer, picture, count);
  times[picture] += performance.now() - start;
  samples[picture] += count;
  const rows = Math.ceil((settings.height - tracerRows.first) / tracerRows.step);
  const copy = new Float32Array(wasm.memory.buffer, sums, 3 * settings.width * rows).slice();
  const { first, step } = tracerRows;
  postMessage({ generation, picture, first, step, samples: samples[picture], time: times[picture], sums: copy }, [copy.buffer]);
  setTimeout(work);
}

onmessage = ({ data }) => {
  const idle = !settings || next() < 0;
  if (data.module) {
    settings = undefined;
    open(data);
  }
  if (data.settings) {
    begin(data);
    if (idle) setTimeout(work);
  }
};
