// A ray's path through V_O's picture: straight, from column to column of lists, or from row to row if it
// crosses more rows. Either is called a column here, and the lists along it are its rows. Progress is counted
// in columns from the start, or as a fraction of the ray's stretch.
//
// The program provides params and ray.
#ifndef VDI_LINE_GLSL
#define VDI_LINE_GLSL
#include "packet.glsl"
#include "view.glsl"

struct PictureLine {
  bool byColumns;
  float start;      // column where it starts
  float columns;    // number of columns to its end, > 0
  float direction;  // 1 or -1, from column to column
  float row;        // row where it starts
  float rows;       // per column
  // Perspective: the number of columns is not proportional to the fraction, which is linear in t and in
  // depth.
  float gain;
  float bend;
  // At the start, and the change to the end. Depths of rays that approach V_O's eye are negative, so that
  // they ascend.
  vec2 depths;
  vec2 bins;  // masks.glsl, not clamped
  int first;  // first column
  int last;
};

PictureLine pictureLine(vec2 stretch) {
  PictureLine line;
  vec2 start = pictureAt(ray, stretch.x);
  vec2 whole = pictureAt(ray, stretch.y) - start;
  line.byColumns = 1.001 * abs(whole.x) >= abs(whole.y);  // diagonals: by columns, despite rounding
  line.start = line.byColumns ? start.x : start.y;
  line.row = line.byColumns ? start.y : start.x;
  float along = line.byColumns ? whole.x : whole.y;
  const float minColumns = 1e-4;  // so that rays that hardly move pass through their column, too
  line.columns = max(abs(along), minColumns);
  line.direction = along < 0.0 ? -1.0 : 1.0;
  float perColumn = 1.0 / line.columns;
  line.rows = (line.byColumns ? whole.y : whole.x) * perColumn;
  vec2 depths = vec2(depthAt(ray, stretch.x), depthAt(ray, stretch.y));
  float divisors = divisorOf(depths.x) / divisorOf(depths.y);
  line.gain = divisors * perColumn;
  line.bend = (divisors - 1.0) * perColumn;
  float change = depths.y - depths.x;
  line.depths = change < 0.0 ? vec2(-depths.x, -change) : vec2(depths.x, change);
  line.bins = vec2(depths.x - params.nearest, change) * params.binScale;
  int maximum = columnCount(line.byColumns) - 1;
  line.first = clamp(int(floor(line.start)), 0, maximum);
  line.last = clamp(int(floor(line.start + line.direction * line.columns)), 0, maximum);
  return line;
}

// Number of columns from the start to a column coordinate, limited to the line.
float columnsTo(PictureLine line, float along) {
  return clamp((along - line.start) * line.direction, 0.0, line.columns);
}

float fractionAfter(PictureLine line, float columns) {
  return columns * line.gain / (1.0 + columns * line.bend);
}

float at(vec2 range, float fraction) { return range.x + fraction * range.y; }

#endif
