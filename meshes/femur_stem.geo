// Proximal femur with a bonded stem, lengths in mm: x medial, y proximal.  The outline is that of femur.geo, cut through
// the neck from control point 15 to 39; the stem goes down the canal from the cut and bears a head, or, with natural = 1,
// is one piece with the femur's own head and neck.
// Parameters are set in the gmsh window, with gmsh -setnumber size 2 or by growthx.meshing.read(..., size=2).

DefineConstant[
  size = {3.5, Min 0.5, Max 10, Step 0.5, Name "size", Label "Cell size in mm"},
  tip = {50, Min 5, Max 70, Step 5, Name "tip", Label "Height of the stem's tip in mm"},
  width = {13, Min 2, Max 30, Step 1, Name "width", Label "Width of the stem at its tip in mm"},
  head = {14, Min 10, Max 18, Step 1, Name "head", Label "Radius of the stem's head in mm"},
  natural = {0, Choices {0, 1}, Name "natural", Label "The femur's own head and neck instead of the stem's"},
  triangles = {0, Choices {0, 1}, Name "triangles", Label "Triangles instead of quadrilaterals"}
];

// The control points of femur_outline.csv, anticlockwise from the distal medial corner: point number = index + 1,
// since gmsh does not treat a point 0 like the others.
// medial shaft
Point(1) = {14.80, 0.00, 0};
Point(2) = {14.90, 12.00, 0};
Point(3) = {15.10, 24.00, 0};
Point(4) = {15.40, 35.00, 0};
Point(5) = {15.80, 45.00, 0};
Point(6) = {16.40, 53.00, 0};
// lesser trochanter
Point(7) = {17.70, 60.00, 0};
Point(8) = {19.90, 65.60, 0};
Point(9) = {22.30, 70.00, 0};
Point(10) = {23.50, 74.40, 0};
Point(11) = {23.00, 78.60, 0};
Point(12) = {21.90, 82.60, 0};
// calcar / inferior neck
Point(13) = {22.00, 87.00, 0};
Point(14) = {23.80, 92.00, 0};
Point(15) = {26.70, 96.70, 0};
Point(16) = {30.40, 100.90, 0};
Point(17) = {34.80, 104.50, 0};
Point(18) = {40.00, 107.10, 0};
Point(19) = {45.80, 108.50, 0};
// head
Point(20) = {51.99, 109.75, 0};
Point(21) = {56.42, 112.10, 0};
Point(22) = {60.55, 115.63, 0};
Point(23) = {63.78, 120.00, 0};
Point(24) = {65.95, 124.98, 0};
Point(25) = {66.94, 130.33, 0};
Point(26) = {66.70, 135.75, 0};
Point(27) = {65.25, 140.99, 0};
Point(28) = {62.66, 145.77, 0};
Point(29) = {59.06, 149.84, 0};
Point(30) = {54.64, 152.99, 0};
Point(31) = {49.62, 155.07, 0};
Point(32) = {44.26, 155.97, 0};
Point(33) = {38.83, 155.64, 0};
Point(34) = {33.62, 154.09, 0};
Point(35) = {28.89, 151.42, 0};
Point(36) = {24.89, 147.75, 0};
Point(37) = {22.01, 143.64, 0};
// superior neck
Point(38) = {19.70, 139.20, 0};
Point(39) = {16.70, 133.80, 0};
Point(40) = {13.00, 129.40, 0};
Point(41) = {8.80, 126.30, 0};
// greater trochanter
Point(42) = {4.60, 124.80, 0};
Point(43) = {0.60, 125.80, 0};
Point(44) = {-3.00, 129.00, 0};
Point(45) = {-6.80, 132.60, 0};
Point(46) = {-10.80, 134.70, 0};
Point(47) = {-15.20, 134.50, 0};
Point(48) = {-19.40, 131.70, 0};
Point(49) = {-23.20, 127.00, 0};
Point(50) = {-26.20, 121.10, 0};
Point(51) = {-28.40, 114.40, 0};
Point(52) = {-29.50, 107.50, 0};
Point(53) = {-29.20, 100.80, 0};
Point(54) = {-27.40, 94.20, 0};
// lateral shaft
Point(55) = {-24.80, 87.60, 0};
Point(56) = {-22.30, 80.20, 0};
Point(57) = {-20.30, 72.00, 0};
Point(58) = {-18.80, 62.50, 0};
Point(59) = {-17.80, 52.00, 0};
Point(60) = {-17.00, 41.00, 0};
Point(61) = {-16.40, 28.00, 0};
Point(62) = {-15.90, 14.00, 0};
Point(63) = {-15.60, 0.00, 0};

Spline(1) = {1:16};
Spline(3) = {40:63};
Line(4) = {63, 1};

// The stem's corners: on the cut, at shares of it; beside the middle of the shaft; and its tip.  scenes/stem.py, which
// looks whether they lie in the bone, has them, too.
middle = -0.5;
Point(101) = {30.40 - 0.1 * 17.40, 100.90 + 0.1 * 28.50, 0};
Point(102) = {middle + width / 2 + 7, 95, 0};
Point(103) = {middle + width / 2 + 1, 75, 0};
Point(104) = {middle + width / 2, tip, 0};
Point(105) = {middle - width / 2, tip, 0};
Point(106) = {middle - width / 2 - 1.5, 90, 0};
Point(107) = {30.40 - 0.85 * 17.40, 100.90 + 0.85 * 28.50, 0};
Line(11) = {16, 101};
Line(12) = {101, 102};
Line(13) = {102, 103};
Line(14) = {103, 104};
Line(15) = {104, 105};
Line(16) = {105, 106};
Line(17) = {106, 107};
Line(18) = {107, 40};
interface[] = {12:17};

If (natural)
  Spline(2) = {16:40};
  upper[] = {2};
  Curve Loop(2) = {2, -18, -17, -16, -15, -14, -13, -12, -11};
  outer[] = {1, 2, 3};
Else
  // The neck, 12 wide, from the middle of the stem's part of the cut to the centre of the head.
  half = 6;
  dx = 43 - (30.40 - 0.475 * 17.40);
  dy = 132 - (100.90 + 0.475 * 28.50);
  long = Sqrt(dx * dx + dy * dy);
  dx = dx / long;
  dy = dy / long;
  back = Sqrt(head * head - half * half);
  Point(110) = {43, 132, 0};
  Point(111) = {43 - back * dx + half * dy, 132 - back * dy - half * dx, 0};
  Point(112) = {43 + head * dy, 132 - head * dx, 0};
  Point(113) = {43 + head * dx, 132 + head * dy, 0};
  Point(114) = {43 - head * dy, 132 + head * dx, 0};
  Point(115) = {43 - back * dx - half * dy, 132 - back * dy + half * dx, 0};
  Line(21) = {101, 111};
  Circle(22) = {111, 110, 112};
  Circle(23) = {112, 110, 113};
  Circle(24) = {113, 110, 114};
  Circle(25) = {114, 110, 115};
  Line(26) = {115, 107};
  upper[] = {21:26};
  Curve Loop(2) = {21:26, -17, -16, -15, -14, -13, -12};
  outer[] = {1, 11, upper[], 18, 3};
EndIf
Curve Loop(1) = {1, 11:18, 3, 4};
Plane Surface(1) = {1};
Plane Surface(2) = {2};

// Even numbers of segments, since only an even boundary can be filled with quadrilaterals.
Transfinite Curve {1} = 2 * Ceil(15 * 3.5 / size) + 1;
Transfinite Curve {3} = 2 * Ceil(23 * 3.5 / size) + 1;
Transfinite Curve {4} = 2 * Round(4 * 3.5 / size) + 1;
straight[] = {11:18};
If (natural)
  Transfinite Curve {2} = 2 * Ceil(24 * 3.5 / size) + 1;
Else
  straight[] += {21:26};
EndIf
For i In {0 : #straight[] - 1}
  ends[] = Boundary { Curve{straight[i]}; };
  a[] = Point{Abs(ends[0])};
  b[] = Point{Abs(ends[1])};
  distance = Sqrt((a[0] - b[0])^2 + (a[1] - b[1])^2);
  Transfinite Curve {straight[i]} = 2 * Ceil(distance / size / 2) + 1;
EndFor

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 8; // frontal-Delaunay for quadrilaterals
Mesh.RecombinationAlgorithm = 2; // simple full-quad: 1 and 3 leave corners of 175 degrees
Mesh.Smoothing = 10;
Mesh.RandomSeed = 1;
If (!triangles)
  Recombine Surface {1, 2};
EndIf

Physical Surface("bone", 1) = {1};
Physical Surface("stem", 2) = {2};
Physical Curve("surface", 3) = {outer[]};
Physical Curve("distal", 4) = {4};
Physical Curve("interface", 5) = {interface[]};
