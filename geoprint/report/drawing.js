// From the state of a scene to what plotly.js draws: surface, paths, robot, axes and camera.

const PATH = "#17212b", BEAD = "#111111", ARM = "#4a5a6a", NEEDLE = "#c2410c";
// The box around the part, in sizes of the part; above it room for the needle where there is a robot.
const MARGIN = 0.06, HEADROOM = 0.2;
// Seen obliquely from above; light from the left behind the reader. A narrow plot is seen from farther away.
const CAMERA = { eye: { x: 0.22, y: -1.22, z: 0.94 }, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: -0.18 } };
const NARROW_PIXELS = 500, NARROW_FACTOR = 1.2;
const LIGHT = { x: -40000, y: -50000, z: 77000 };
// Places of the traces that move: bead, arm, needle.
const ROBOT = [3, 4, 5];
// A line of nothing: plotly.js fails on one without any point.
const NOTHING = [[null], [null], [null]];
// The part fills about this share of the plot.
const SEEN_SHARE = 0.65;
const TURN = Math.PI / 24, ZOOM = 1.15;

function firstCamera(width) {
  const camera = structuredClone(CAMERA), factor = width < NARROW_PIXELS ? NARROW_FACTOR : 1;
  for (const axis of "xyz") camera.eye[axis] *= factor;
  return camera;
}

// Number of values not above the wanted one; they do not fall.
function countUpTo(values, wanted) {
  let low = 0, high = values.length;
  while (low < high) {
    const half = (low + high) >> 1;
    if (values[half] <= wanted) low = half + 1; else high = half;
  }
  return low;
}

function pose(replay, time) {
  const after = Math.min(Math.max(countUpTo(replay.times, time), 1), replay.times.length - 1), before = after - 1;
  const share = Math.min(Math.max((time - replay.times[before]) / (replay.times[after] - replay.times[before]), 0), 1);
  const between = (values, size) => Array.from({ length: size }, (_, place) =>
    (1 - share) * values[before * size + place] + share * values[after * size + place]);
  const points = (flat) => [0, 1, 2].map((axis) => flat.filter((_, place) => place % 3 === axis));
  const arm = between(replay.arm, 3 * replay.joints), elbow = between(replay.elbows, 3), tip = between(replay.tips, 3);
  const laid = countUpTo(replay.beadTimes, time);
  return {
    arm: points([...arm, ...elbow]), needle: points([...elbow, ...tip]),
    laid: laid ? replay.bead.map((row) => row.subarray(0, laid)) : NOTHING,
    deposit: replay.deposit[share < 0.5 ? before : after] === 1,
  };
}


function line(points, colour, width, mode = "lines") {
  return {
    type: "scatter3d", mode, x: points[0], y: points[1], z: points[2], hoverinfo: "skip", showlegend: false,
    line: { color: colour, width }, marker: { color: colour, size: width * 0.9 }, connectgaps: false,
  };
}

// Line widths in pixels: shares of the spacing as it is seen about now, so that dense paths leave colour between them.
function widths(part, state, pixels) {
  const seen = (part.spacing * SEEN_SHARE * pixels) / corners(part, state.frame === "robot").size;
  const between = (low, value, high) => Math.min(Math.max(value, low), high);
  return { path: between(0.8, 0.14 * seen, 2.5), bead: between(1.5, 0.5 * seen, 8) };
}

function traces(part, state, pixels) {
  const width = widths(part, state, pixels);
  const backend = part.backends[state.backend];
  const { legend, said, ...colouring } = COLOURINGS[state.colour](part, backend);
  const [x, y, z] = part.vertices, [i, j, k] = part.faces;
  const surface = {
    type: "mesh3d", x, y, z, i, j, k, ...colouring, text: part.places.map((place, at) => said(at) + place),
    hovertemplate: "%{text}<extra></extra>",
    // Faces are small in proportion to all that is drawn: without the zeros plotly.js takes them for flat ones.
    lighting: { ambient: 0.62, diffuse: 0.5, specular: 0.03, roughness: 0.9, fresnel: 0.02,
      vertexnormalsepsilon: 0, facenormalsepsilon: 0 },
    lightposition: LIGHT, flatshading: false,
  };
  const now = state.robot && backend.replay ? pose(backend.replay, state.time) : null;
  return {
    legend,
    list: [
      surface,
      { ...line(backend.path, PATH, width.path), visible: state.paths },
      frameTrace(part),
      line(now ? now.laid : NOTHING, BEAD, width.bead),
      line(now ? now.arm : NOTHING, ARM, 9, "lines+markers"),
      line(now ? now.needle : NOTHING, NEEDLE, 6),
    ],
  };
}

// Two opposite corners of the box around the part, or around everything that moves too.
function corners(part, withRobot) {
  const low = [], high = [];
  const reach = (axis, value) => {
    low[axis] = Math.min(low[axis] ?? value, value);
    high[axis] = Math.max(high[axis] ?? value, value);
  };
  part.vertices.forEach((row, axis) => row.forEach((value) => reach(axis, value)));
  if (withRobot) {
    part.backends.forEach(({ replay }) => replay?.arm.forEach((value, place) => reach(place % 3, value)));
  }
  return { low, high, size: Math.max(...high.map((value, axis) => value - low[axis])) };
}

// An unseen cube around everything. plotly.js shades a surface in the proportions of all that is drawn: with a cube
// the light stays as it is when the robot comes and goes.
function frameTrace(part) {
  const { low, high, size } = corners(part, true);
  const [x, y, z] = low.map((value, axis) => [-1, 1].map((side) => 0.5 * (value + high[axis] + side * size)));
  return { type: "scatter3d", mode: "markers", x, y, z, hoverinfo: "skip", showlegend: false, opacity: 0,
    marker: { size: 0.1 } };
}

function extent(part, state) {
  const { low, high, size } = corners(part, state.frame === "robot");
  const ranges = low.map((value, axis) => [value - MARGIN * size, high[axis] + MARGIN * size]);
  if (state.frame === "part" && part.backends.some(({ replay }) => replay)) ranges[2][1] += HEADROOM * size;
  return ranges;
}

function layout(part, state) {
  const ranges = extent(part, state), lengths = ranges.map(([low, high]) => high - low);
  const largest = Math.max(...lengths);
  const axis = (letter, place) => ({
    title: { text: `${letter} [mm]`, font: { ...FONT, size: 11 } }, range: ranges[place], autorange: false,
    tickfont: { ...FONT, size: 10, color: "#5b6770" }, nticks: 5, gridcolor: "#d9dfe4", zeroline: false,
    showspikes: false, showbackground: false, linecolor: "#9aa5ae", showline: true,
  });
  return {
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "#ffffff", font: FONT, hovermode: "closest",
    hoverlabel: { bgcolor: "#ffffff", bordercolor: "#1c2730", font: FONT },
    scene: {
      xaxis: axis("x", 0), yaxis: axis("y", 1), zaxis: axis("z", 2), domain: { x: [0, 1], y: [0.13, 1] },
      aspectmode: "manual", camera: state.camera,
      aspectratio: { x: lengths[0] / largest, y: lengths[1] / largest, z: lengths[2] / largest },
    },
  };
}

const CONFIG = { displayModeBar: false, displaylogo: false, responsive: true, showTips: false, scrollZoom: true };

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
  const moved = eyes[key](), length = Math.hypot(moved.x, moved.y, moved.z);
  // Not over the pole, where left and right would change places.
  const height = (moved.x * up[0] + moved.y * up[1] + moved.z * up[2]) / length;
  return Math.abs(height) > 0.995 ? camera : { ...camera, eye: moved };
}
