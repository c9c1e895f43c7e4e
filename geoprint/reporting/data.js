// The data of a part: arrays from base64, places split into x, y and z.

const ARRAYS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array, u2: Uint16Array };
const NOT_A_NUMBER = 65535;

function decoded(array) {
  const bytes = Uint8Array.from(atob(array.bdata), (letter) => letter.charCodeAt(0));
  const values = new ARRAYS[array.dtype](bytes.buffer);
  if (array.step === undefined) return values;
  return Float32Array.from(values, (value) => (value === NOT_A_NUMBER ? NaN : array.low + value * array.step));
}

// Split an array of three rows into x, y and z.
function rows(array) {
  const values = decoded(array), count = values.length / 3;
  return [0, 1, 2].map((row) => values.subarray(row * count, (row + 1) * count));
}

// What a page has only of some scenes.
const ifAny = (array, read) => array && read(array);

function unpack(data) {
  const path = ifAny(data.path, rows);
  return {
    ...data,
    vertices: rows(data.vertices),
    faces: rows(data.faces),
    machine: data.machine && machineOf(data.machine),
    overhang: ifAny(data.overhang, decoded),
    backends: data.backends.map((backend) => ({
      name: backend.name,
      distance: ifAny(backend.distance, decoded),
      spacing: ifAny(backend.ratios, decoded),
      coverage: ifAny(backend.coverage, decoded),
      thickness: ifAny(backend.thickness, decoded),
      path: path ?? rows(backend.path),
      half: ifAny(backend.half, rows),
      layers: data.layers ?? backend.layers,
      lean: ifAny(backend.lean, decoded),
      speed: ifAny(backend.speed, decoded),
      replay: backend.replay && {
        times: decoded(backend.replay.times),
        joints: decoded(backend.replay.joints),
        speeds: decoded(backend.replay.speeds),
        valve: backend.replay.valve,
        lamp: backend.replay.lamp,
        bead: rows(backend.replay.bead),
        beadTimes: decoded(backend.replay.beadTimes),
        table: backend.replay.table,
      },
    })),
  };
}

// Where a vertex is in the part's own coordinates, as text.
function placeOf({ rotation, middle, vertices }, at) {
  const [x, y, z] = [0, 1, 2].map((axis) =>
    (middle[axis] + vertices.reduce((sum, row, place) => sum + rotation[place][axis] * row[at], 0)).toFixed(2));
  return `x ${x}, y ${y}, z ${z} mm in the file`;
}
