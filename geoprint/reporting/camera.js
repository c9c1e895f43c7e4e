// From where the part is seen, and how keys turn it.

// Seen obliquely from above; light from the left behind the reader. A narrow plot is seen from farther away.
const CAMERA = { eye: { x: 0.2, y: -1.12, z: 0.86 }, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: -0.1 } };
const TURN = Math.PI / 24, ZOOM = 1.15;
// A plot this much wider than high, or more, is filled by its height.
const WIDE = 1;

function firstCamera({ clientWidth, clientHeight }) {
  const camera = structuredClone(CAMERA), factor = Math.max(WIDE / (clientWidth / (clientHeight || 1) || WIDE), 1);
  for (const axis of "xyz") camera.eye[axis] *= factor;
  return camera;
}

function turned({ x, y, z }, about, angle) {
  const cosine = Math.cos(angle), sine = Math.sin(angle), v = [x, y, z];
  const along = about.reduce((sum, value, axis) => sum + value * v[axis], 0);
  const side = [0, 1, 2].map((axis) =>
    about[(axis + 1) % 3] * v[(axis + 2) % 3] - about[(axis + 2) % 3] * v[(axis + 1) % 3]);
  const [a, b, c] = v.map((value, axis) => value * cosine + side[axis] * sine + about[axis] * along * (1 - cosine));
  return { x: a, y: b, z: c };
}

function unit(vector) {
  const length = Math.hypot(...vector) || 1;
  return vector.map((value) => value / length);
}

function cameraAfter(key, camera) {
  const { eye } = camera, up = unit([camera.up.x, camera.up.y, camera.up.z]);
  const right = unit([up[1] * eye.z - up[2] * eye.y, up[2] * eye.x - up[0] * eye.z, up[0] * eye.y - up[1] * eye.x]);
  const scaled = (factor) => ({ x: eye.x * factor, y: eye.y * factor, z: eye.z * factor });
  const eyes = {
    ArrowLeft: () => turned(eye, up, -TURN), ArrowRight: () => turned(eye, up, TURN),
    ArrowUp: () => turned(eye, right, -TURN), ArrowDown: () => turned(eye, right, TURN),
    "+": () => scaled(1 / ZOOM), "=": () => scaled(1 / ZOOM), "-": () => scaled(ZOOM),
  };
  if (!(key in eyes)) return null;
  const gone = eyes[key](), length = Math.hypot(gone.x, gone.y, gone.z);
  // Not over the pole, where left and right would change places.
  const height = (gone.x * up[0] + gone.y * up[1] + gone.z * up[2]) / length;
  return Math.abs(height) > 0.995 ? camera : { ...camera, eye: gone };
}
