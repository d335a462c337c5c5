// The errors of README.md: of luminance, against two references a and b that do not depend on one another. So (y - a)(y - b) estimates
// the squared error of y without the noise of both.

export const luminance = (rgb, i) => 0.2126 * rgb[3 * i] + 0.7152 * rgb[3 * i + 1] + 0.0722 * rgb[3 * i + 2];

// `a` and `b`: luminances. Relative: mean of d^2 / (truth^2 + 1e-4 mean^2); absolute: mean of d^2 / mean^2.
export function score(picture, a, b) {
  let mean = 0, relative = 0, absolute = 0;
  for (let i = 0; i < a.length; i++) mean += (a[i] + b[i]) / (2 * a.length);
  for (let i = 0; i < a.length; i++) {
    const squared = (picture[i] - a[i]) * (picture[i] - b[i]), truth = (a[i] + b[i]) / 2;
    relative += squared / (truth * truth + 1e-4 * mean * mean);
    absolute += squared / (mean * mean);
  }
  return { relative: relative / a.length, absolute: absolute / a.length };
}

export const NAMES = ["mis", "wis"];

// Errors against time on logarithmic axes, as SVG; `points`: { time, mis, wis } with errors in `metric`.
export function plot(points, metric) {
  const values = points.flatMap((p) => NAMES.map((name) => p[name][metric])).filter((v) => v > 0);
  if (values.length < 2) return "";
  const [low, high] = [Math.floor(Math.log10(Math.min(...values))), Math.ceil(Math.log10(Math.max(...values)))];
  const [from, to] = [Math.log10(points[0].time), Math.log10(points.at(-1).time)];
  const x = (time) => 44 + (250 * (Math.log10(time) - from)) / Math.max(to - from, 1e-6);
  const y = (error) => 12 + (128 * (high - Math.log10(error))) / Math.max(high - low, 1);
  let svg = "";
  for (let power = low; power <= high; power++) {
    const at = y(10 ** power);
    svg += `<path class="grid" d="M44 ${at}H294"/><text x="38" y="${at + 4}" text-anchor="end">10<tspan dy="-4" font-size="8">${power}</tspan></text>`;
  }
  for (const [i, { time }] of points.entries()) {
    if (i % Math.ceil(points.length / 5) === 0) svg += `<text x="${x(time)}" y="157" text-anchor="middle">${+(time / 1000).toPrecision(2)} s</text>`;
  }
  for (const name of NAMES) {
    const line = points.filter((p) => p[name][metric] > 0).map((p) => [x(p.time), y(p[name][metric])]);
    svg += `<polyline class="${name}" points="${line.join(" ")}"/>`;
    svg += line.map(([cx, cy]) => `<circle class="${name}" cx="${cx}" cy="${cy}" r="3"/>`).join("");
  }
  return svg;
}
