// Beads as solids: half tubes over the path, as wide as the bead is wanted.

// Points of half a ring, from the left side over the top to the right.
const RING = Array.from({ length: 7 }, (_, at) => (Math.PI * at) / 6).map((angle) => [Math.cos(angle), Math.sin(angle)]);

// Vertices and faces of a backend's beads; made once.
function beadsOf(backend) {
  return (backend.beads ??= tubes(backend.path, backend.half));
}

// Half tubes over the (3, k) places of a path, NaN between its stretches, with the (3, k) steps to their left sides.
function tubes(path, half) {
  const count = path[0].length, at = (array, place) => array.map((row) => row[place]);
  const there = (place) => place >= 0 && place < count && !Number.isNaN(path[0][place]);
  const vertices = [0, 1, 2].map(() => new Float32Array(count * RING.length)), faces = [[], [], []];
  for (let place = 0; place < count; place += 1) {
    if (!there(place)) continue;
    const last = at(path, there(place - 1) ? place - 1 : place), next = at(path, there(place + 1) ? place + 1 : place);
    const middle = at(path, place), left = at(half, place), up = upOf(next.map((value, axis) => value - last[axis]), left);
    RING.forEach(([aside, over], corner) => vertices.forEach((row, axis) => {
      row[place * RING.length + corner] = middle[axis] + aside * left[axis] + over * up[axis];
    }));
    if (there(place + 1)) join(faces, place * RING.length);
  }
  return { vertices, faces: faces.map((row) => Int32Array.from(row)) };
}

// What stands on both the way along and the way to the left, as long as this.
function upOf([a, b, c], [x, y, z]) {
  const up = [b * z - c * y, c * x - a * z, a * y - b * x], size = Math.hypot(x, y, z) / (Math.hypot(...up) || 1);
  return up.map((value) => value * size);
}

// Two triangles for each side of the ring that begins at a vertex and the one after it.
function join(faces, first) {
  for (let corner = first; corner < first + RING.length - 1; corner += 1) {
    const beyond = corner + RING.length;
    [[corner, beyond], [corner + 1, corner + 1], [beyond, beyond + 1]].forEach((pair, row) => faces[row].push(...pair));
  }
}
