// The robot: where its joints, links and tool are at a moment of the replay.

const KINDS = ["body", "cell", "table", "arm", "tool"];
const STILL = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]];
// Where nothing tilts the part it stands as it rests.
const AT_REST = { number: 0, frame: 0, part: STILL, solids: [] };

// Join the bodies of each kind: all vertices as they are with the joints at zero, and which joint moves each.
function machineOf({ points, directions, bodies }) {
  const kinds = Object.fromEntries(KINDS.map((kind) => {
    const own = bodies.filter((body) => body.kind === kind).map((body) =>
      ({ joint: body.joint, vertices: rows(body.vertices), faces: rows(body.faces) }));
    const faces = [[], [], []], spans = [];
    let count = 0;
    for (const { joint, vertices, faces: each } of own) {
      each.forEach((row, corner) => row.forEach((at) => faces[corner].push(at + count)));
      spans.push({ joint, from: count, to: count += vertices[0].length });
    }
    const vertices = [0, 1, 2].map((axis) => own.flatMap((body) => Array.from(body.vertices[axis])));
    return [kind, { vertices, faces: faces.map((row) => Int32Array.from(row)), spans }];
  }));
  return { points, directions, kinds };
}

// A turn about a line through a point, as rows of a 3 x 4 matrix.
function turnAbout(point, [x, y, z], angle) {
  const c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
  return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s], [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
    [z * x * d - y * s, z * y * d + x * s, c + z * z * d]].map((row, axis) =>
    [...row, point[axis] - row[0] * point[0] - row[1] * point[1] - row[2] * point[2]]);
}

function after(a, b) {
  return a.map((row) => [0, 1, 2, 3].map((column) =>
    row[0] * b[0][column] + row[1] * b[1][column] + row[2] * b[2][column] + (column === 3 ? row[3] : 0)));
}

// The motion of each joint's link from where it is at zero; the first stands still.
function motions({ points, directions }, joints) {
  const found = [STILL];
  joints.forEach((angle, joint) =>
    found.push(after(found[joint], turnAbout(points[joint], directions[joint], angle))));
  return found;
}

// Vertices of a kind of body, moved.
function moved({ vertices, spans }, motion) {
  const [x, y, z] = vertices, count = x.length;
  const places = [0, 1, 2].map(() => new Float32Array(count));
  for (const { joint, from, to } of spans) {
    motion[joint].forEach(([a, b, c, shift], axis) => {
      for (let at = from; at < to; at += 1) places[axis][at] = a * x[at] + b * y[at] + c * z[at] + shift;
    });
  }
  return places;
}

// Places that stand together, moved.
function placed([x, y, z], motion) {
  if (motion === STILL) return [x, y, z];
  return motion.map(([a, b, c, shift]) =>
    Float32Array.from(x, (value, at) => a * value + b * y[at] + c * z[at] + shift));
}

// A motion so far between two others that what is between goes straight.
function mixed(one, other, share) {
  return one.map((row, axis) => row.map((value, at) => (1 - share) * value + share * other[axis][at]));
}

// How part and table stand at a moment: at rest, on the course to an attitude, or in the one that was come to last; and
// in which frame that is, a fraction between two.
function standing({ table }, time) {
  if (!table) return AT_REST;
  const { turning, times, part, solids } = table, number = countUpTo(turning.map(([, end]) => end), time);
  const next = countUpTo(times, time), last = Math.max(next - 1, 0);
  if (!within(turning, time)) return { number, frame: last, part: part[last], solids: solids[last] };
  const share = (time - times[last]) / (times[next] - times[last]);
  return { number, frame: last + share, part: mixed(part[last], part[next], share),
    solids: solids[last].map((one, at) => mixed(one, solids[next][at], share)) };
}

// Solids of the table as they stand; the machine numbers them from 1.
function tablePlaces(machine, { solids }) {
  return moved(machine.kinds.table, [STILL, ...solids]);
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

function within(spans, time) {
  return spans.some(([begin, end]) => begin <= time && time < end);
}

// What is so at a moment: the joints, the speed of the tip, valve and lamp, and how much is laid.
function moment(replay, wanted) {
  const { times, joints, speeds } = replay, size = joints.length / times.length;
  const time = Math.min(wanted, times[times.length - 1]);
  const next = Math.min(Math.max(countUpTo(times, time), 1), times.length - 1), before = next - 1;
  const share = Math.min(Math.max((time - times[before]) / (times[next] - times[before]), 0), 1);
  const between = (values, at, stride) => (1 - share) * values[before * stride + at] + share * values[next * stride + at];
  const turning = within(replay.table?.turning ?? [], time);
  return {
    joints: Array.from({ length: size }, (_, joint) => between(joints, joint, size)),
    speed: turning ? 0 : between(speeds, 0, 1),
    valve: within(replay.valve, time), lamp: within(replay.lamp, time), turning,
    run: countUpTo(replay.valve.map(([begin]) => begin), time), runs: replay.valve.length,
    laid: countUpTo(replay.beadTimes, time),
  };
}

// Two opposite corners of all places where the robot is, at some moments of all replays.
function reachOf(machine, replays) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const replay of replays) {
    const end = replay.times[replay.times.length - 1];
    for (let step = 0; step <= 24; step += 1) {
      const motion = motions(machine, moment(replay, (step / 24) * end).joints);
      for (const kind of ["arm", "tool"]) {
        moved(machine.kinds[kind], motion).forEach((row, axis) => {
          for (const value of row) {
            if (value < low[axis]) low[axis] = value;
            if (value > high[axis]) high[axis] = value;
          }
        });
      }
    }
  }
  return { low, high };
}
