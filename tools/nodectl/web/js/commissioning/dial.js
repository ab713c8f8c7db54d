// Places on a dial: angles in degrees from the top, clockwise.

const CENTRE = 110;

/** The place of an angle at a distance from the centre. */
export function point(angle, radius) {
  const radians = ((angle - 90) * Math.PI) / 180;
  return [CENTRE + radius * Math.cos(radians), CENTRE + radius * Math.sin(radians)].map((place) => Number(place.toFixed(2)));
}

/** The path of an arc from one angle to another. */
export function arc(from, to, radius) {
  const width = (((to - from) % 360) + 360) % 360;
  const [start, end] = [point(from, radius), point(to, radius)];
  return `M${start.join(" ")}A${radius} ${radius} 0 ${width > 180 ? 1 : 0} 1 ${end.join(" ")}`;
}
