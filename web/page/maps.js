// Maps: two that are made here, and Radiance files. Each is { width, height, texels }: RGB floats, row by row, +z up.

const WIDTH = 1024;
const HEIGHT = 512;

function make(radiance) {
  const texels = new Float32Array(3 * WIDTH * HEIGHT);
  for (let y = 0; y < HEIGHT; y++) {
    for (let x = 0; x < WIDTH; x++) {
      texels.set(radiance(((x + 0.5) * 360) / WIDTH, 90 - ((y + 0.5) * 180) / HEIGHT), 3 * (y * WIDTH + x));
    }
  }
  return { width: WIDTH, height: HEIGHT, texels };
}

// A dark room with a soft box, strip lights and small lamps: azimuth, elevation and half sizes in degrees, radiance.
const LAMPS = [
  [235, 38, 13, 10, [9, 9.4, 10]], [318, 30, 3, 24, [16, 14, 11]], [40, 44, 2.2, 2.2, [190, 130, 70]],
  [150, 50, 1.5, 1.5, [60, 120, 210]], [95, 18, 22, 1.2, [5, 8, 14]], [285, 68, 1, 1, [420, 400, 380]],
];

export function studio() {
  return make((azimuth, elevation) => {
    const lamp = LAMPS.find(([a, e, w, h]) => Math.abs(azimuth - a) < w && Math.abs(elevation - e) < h);
    const wall = 0.035 + 0.03 * Math.max(0, elevation / 90);
    return lamp ? lamp[4] : [wall, wall * 1.05, wall * 1.15];
  });
}

// A clear sky with a sun of half a degree.
export function sky() {
  const radians = Math.PI / 180, sun = [232, 34].map((angle) => angle * radians);
  return make((azimuth, elevation) => {
    const [a, e] = [azimuth * radians, elevation * radians];
    const cosine = Math.sin(e) * Math.sin(sun[1]) + Math.cos(e) * Math.cos(sun[1]) * Math.cos(a - sun[0]);
    const away = Math.acos(Math.min(1, cosine)) / radians, haze = Math.exp(-away / 9) * 1.6;
    if (away < 0.3) return [26000, 23000, 19000];
    const low = Math.exp(-Math.abs(elevation) / (elevation < 0 ? 7 : 16));
    if (elevation < 0) return [0.14 + 0.4 * low, 0.15 + 0.42 * low, 0.15 + 0.5 * low];
    return [0.12 + 0.5 * low + haze, 0.24 + 0.42 * low + 0.85 * haze, 0.6 + 0.2 * low + 0.6 * haze];
  });
}

// Reads a Radiance picture: rows of pixels that share an exponent, plain or in runs for each channel.
export function readHdr(buffer) {
  const bytes = new Uint8Array(buffer);
  let at = 0;
  const line = () => {
    let text = "";
    while (at < bytes.length && bytes[at] !== 10) text += String.fromCharCode(bytes[at++]);
    at++;
    return text;
  };
  if (!line().startsWith("#?")) throw new Error("This is no Radiance file (.hdr).");
  for (let text = line(); text !== ""; text = line()) {
    if (at >= bytes.length) throw new Error("The file is cut off in its header.");
    if (/^FORMAT=(?!32-bit_rle_rgbe)/.test(text)) throw new Error(`${text} cannot be read.`);
  }
  const size = /^-Y (\d+) \+X (\d+)$/.exec(line());
  if (!size) throw new Error("Rows must run from top to bottom, columns from left to right.");
  const [height, width] = [Number(size[1]), Number(size[2])];
  if (!(width > 0 && height > 0 && width * height <= 1 << 27)) throw new Error("The map is empty or too large.");
  const texels = new Float32Array(3 * width * height), row = new Uint8Array(4 * width);
  for (let y = 0; y < height; y++) {
    at = readRow(bytes, at, row, width);
    for (let x = 0; x < width; x++) {
      const unit = row[4 * x + 3] ? 2 ** (row[4 * x + 3] - 136) : 0;
      for (let k = 0; k < 3; k++) texels[3 * (y * width + x) + k] = row[4 * x + k] * unit;
    }
  }
  return shrink({ width, height, texels });
}

// Reads a row and answers where the next one begins.
function readRow(bytes, at, row, width) {
  const inRuns = width >= 8 && width < 32768 && bytes[at] === 2 && bytes[at + 1] === 2 && bytes[at + 2] < 128;
  if (!inRuns) {
    if (at + 4 * width > bytes.length) throw new Error("The file is cut off.");
    row.set(bytes.subarray(at, at + 4 * width));
    return at + 4 * width;
  }
  at += 4;
  for (let k = 0; k < 4; k++) {
    for (let x = 0; x < width; ) {
      const code = bytes[at++], count = code > 128 ? code - 128 : code;
      if (!(count > 0 && x + count <= width)) throw new Error("The file is cut off or broken.");
      for (let i = 0; i < count; i++) row[4 * x++ + k] = code > 128 ? bytes[at] : bytes[at++];
      at += code > 128 ? 1 : 0;
    }
  }
  return at;
}

// Halves a map, by means of four texels, until each worker has room for it.
function shrink(map) {
  while (map.width > 2048 || map.height > 1024) {
    const [width, height] = [map.width >> 1, map.height >> 1], texels = new Float32Array(3 * width * height);
    for (let y = 0; y < height; y++) {
      for (let i = 0; i < 3 * width; i++) {
        const from = 3 * (2 * y * map.width + 2 * Math.floor(i / 3)) + (i % 3), below = from + 3 * map.width;
        texels[3 * y * width + i] = (map.texels[from] + map.texels[from + 3] + map.texels[below] + map.texels[below + 3]) / 4;
      }
    }
    map = { width, height, texels };
  }
  return map;
}
