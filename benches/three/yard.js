// The yard: so many equal cubes on a square grid, 3 m apart, in sixteen bump-mapped materials, under point lights of 10 m
// range. README.md says what is measured; `clustered.js` and `nearest.js` draw it.

const query = new URLSearchParams(location.search);
const plan = {
  objects: Number(query.get('objects')),
  lights: Number(query.get('lights')),
  width: Number(query.get('width')),
  height: Number(query.get('height')),
  inside: query.get('view') === 'inside',
  moving: query.get('motion') === 'moving',
  /** How many along a side of the grid. */
  tiles: Number(query.get('tiles')),
  /** Lights that a cluster has room for. */
  room: Number(query.get('room')),
};
const SPACING = 3;
const SIZE = 1.5;
const MATERIALS = 16;
const side = Math.max(Math.ceil(Math.sqrt(plan.objects)), 1);
const half = ((side - 1) * SPACING) / 2;

/** The generator of Numerical Recipes. */
function numbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return (state >>> 8) / (1 << 24);
  };
}

function objects() {
  const unit = numbers(1);
  return Array.from({ length: plan.objects }, (_, i) => {
    const [column, row] = [i % side, Math.floor(i / side)];
    const material = Math.floor(unit() * MATERIALS);
    const phase = Math.fround(unit() * 2 * Math.PI);
    const tile = Math.floor((row * plan.tiles) / side) * plan.tiles + Math.floor((column * plan.tiles) / side);
    return { x: column * SPACING - half, z: row * SPACING - half, phase, group: tile * MATERIALS + material };
  });
}

/** Positions, and linear colours times intensity. */
function lights() {
  const unit = numbers(2);
  return Array.from({ length: plan.lights }, () => {
    const [x, z] = [(unit() * 2 - 1) * half, (unit() * 2 - 1) * half];
    const [y, hue] = [2 + unit() * 2, unit()];
    const wave = (k) => Math.max(-1, Math.min(1, k - 3, 9 - k));
    const channel = (n) => 14 * (0.7 - 0.18 * wave(((n / 12 + hue) % 1) * 12)) ** 2.2;
    return { position: [x, y, z], color: [channel(0), channel(8), channel(4)] };
  });
}

/** Turning and bobbing: writes `world_from_object`, column by column, into a list of identities. */
function pose(object, seconds, matrices, at) {
  const s = Math.sin(object.phase + seconds);
  const c = Math.cos(object.phase + seconds);
  matrices[at] = c;
  matrices[at + 2] = -s;
  matrices[at + 8] = s;
  matrices[at + 10] = c;
  matrices[at + 12] = object.x;
  matrices[at + 13] = 0.75 + 0.25 * (1 + Math.sin(2 * seconds + object.phase));
  matrices[at + 14] = object.z;
}

/** Base, normal and specular map of a material, 256×256 RGBA: bricks, plates, waves and grain in four colours each. */
function maps(material) {
  const [SIDE, kind, variant] = [256, material % 4, Math.floor(material / 4)];
  const unit = numbers(100 + material);
  const grain = Float32Array.from({ length: SIDE * SIDE }, unit);
  const height = new Float32Array(SIDE * SIDE);
  for (let i = 0; i < SIDE * SIDE; i++) {
    const [u, v] = [(i % SIDE) / SIDE, Math.floor(i / SIDE) / SIDE];
    const row = Math.floor(v * 8);
    const edge = (w) => Math.min(w % 1, 1 - (w % 1));
    const shape = [
      Math.min(edge(u * 4 + 0.5 * (row % 2)) * 12, edge(v * 8) * 6, 1),
      Math.hypot(edge(u * (4 + variant)), edge(v * (4 + variant))),
      0.5 + 0.5 * Math.sin(2 * Math.PI * (u * (5 + variant) + 0.3 * Math.sin(4 * Math.PI * v))),
      0.5,
    ][kind];
    height[i] = 0.8 * shape + 0.2 * grain[i];
  }
  const [base, normal, specular] = [0, 1, 2].map(() => new Uint8Array(SIDE * SIDE * 4));
  const at = (x, y) => height[((y + SIDE) % SIDE) * SIDE + ((x + SIDE) % SIDE)];
  for (let i = 0; i < SIDE * SIDE; i++) {
    const [x, y] = [i % SIDE, Math.floor(i / SIDE)];
    const slope = [(at(x - 1, y) - at(x + 1, y)) * 5, (at(x, y - 1) - at(x, y + 1)) * 5];
    const length = Math.hypot(slope[0], slope[1], 1);
    const tint = (n) => 0.6 + 0.15 * Math.cos(2 * Math.PI * (material / MATERIALS + n / 3));
    base.set([0, 1, 2, 3].map((n) => (n < 3 ? 255 * tint(n) * (0.5 + 0.5 * height[i]) : 255)), i * 4);
    normal.set([127.5 + (127.5 * slope[0]) / length, 127.5 + (127.5 * slope[1]) / length, 127.5 + 127.5 / length, 255], i * 4);
    specular.set([0, 1, 2, 3].map((n) => (n < 3 ? 255 * (0.2 + 0.8 * height[i]) : 255)), i * 4);
  }
  return { side: SIDE, base, normal, specular };
}

/** Where the camera stands and what it looks at. */
function view() {
  const between = (v) => Math.floor((v + half) / SPACING) * SPACING - half + SPACING / 2;
  if (plan.inside) {
    const eye = [between(0.194 * half), 2, between(0)];
    return { eye, target: [eye[0] + 1, eye[1], eye[2]] };
  }
  const distance = (half * Math.SQRT2 + SIZE) * 2 * Math.SQRT1_2;
  return { eye: [0, distance, distance], target: [0, 0, 0] };
}

const post = (path, body) => fetch(path, { method: 'POST', body });
const quantile = (values, q) => values.toSorted((a, b) => a - b)[Math.floor((values.length - 1) * q)];

async function measure() {
  const { start } = await import(query.get('how') === 'clustered' ? './clustered.js' : './nearest.js');
  const world = { plan, size: SIZE, materials: MATERIALS, objects: objects(), lights: lights(), maps, pose, view: view() };
  const yard = await start(world);
  let number = 0;
  const frame = async () => {
    const before = performance.now();
    if (plan.moving) yard.move(++number / 60);
    yard.draw();
    const drawn = performance.now();
    yard.finish();
    return [performance.now() - before, drawn - before];
  };
  await frame();
  const first = performance.now() / 1e3;
  for (let i = 0; i < 10 && performance.now() / 1e3 < first + 10; i++) await frame();
  const times = [];
  const end = performance.now() + 1e3 * Number(query.get('seconds'));
  while (times.length < Number(query.get('frames')) && (times.length < 5 || performance.now() < end)) {
    times.push(await frame());
    // The browser's turn.
    await new Promise((resolve) => setTimeout(resolve));
  }
  if (query.get('shot')) {
    yard.draw();
    const blob = await new Promise((resolve) => yard.canvas.toBlob(resolve));
    await post('/shot', blob);
  }
  const [whole, page] = [0, 1].map((i) => times.map((time) => time[i]));
  return {
    three: yard.revision, adapter: yard.adapter, how: query.get('how'), ...plan, frames: times.length,
    frame_ms_median: quantile(whole, 0.5), frame_ms_p05: quantile(whole, 0.05), frame_ms_p95: quantile(whole, 0.95),
    cpu_ms_median: quantile(page, 0.5), first_frame_s: first, draws: yard.draws(),
  };
}

measure()
  .then((result) => post('/done', JSON.stringify(result)))
  .catch((error) => post('/failed', `${error}\n${error.stack}`));
addEventListener('error', (event) => post('/failed', `${event.message}`));
