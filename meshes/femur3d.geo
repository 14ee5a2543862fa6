// Proximal femur in space, lengths in mm: the centre of the head is the origin, x lateral, y anterior, z superior; of a
// left one x is medial.  A loft of ovals, from the shaft through the metaphysis to the neck, with the head, a sphere,
// and both trochanters, ellipsoids.
// Parameters are set in the gmsh window, with gmsh -setnumber size 3 or by growthx.meshing.read(..., size=3).

SetFactory("OpenCASCADE");
Geometry.OCCThruSectionsDegree = 3; // higher ones overshoot

DefineConstant[
  size = {3.4, Min 0.5, Max 12, Step 0.5, Name "size", Label "Cell size in mm"},
  head_radius = {24, Min 15, Max 35, Step 0.5, Name "head_radius", Label "Radius of the head in mm"},
  neck_shaft_angle = {128, Min 110, Max 145, Step 1, Name "neck_shaft_angle", Label "Between neck and shaft in degrees"},
  version = {9, Min -10, Max 35, Step 1, Name "version", Label "Of the neck, anteriorly, in degrees"},
  offset = {46, Min 30, Max 65, Step 0.5, Name "offset", Label "Of the head's centre from the shaft's axis in mm"},
  neck_width = {25, Min 12, Max 60, Step 0.5, Name "neck_width", Label "Of the neck, front to back, in mm"},
  neck_height = {33, Min 15, Max 60, Step 0.5, Name "neck_height", Label "Of the neck at its narrowest in mm"},
  shaft_width = {28, Min 18, Max 45, Step 0.5, Name "shaft_width", Label "Of the shaft, side to side, in mm"},
  shaft_depth = {30, Min 18, Max 45, Step 0.5, Name "shaft_depth", Label "Of the shaft, front to back, in mm"},
  lean = {7, Min -5, Max 20, Step 0.5, Name "lean", Label "Of the shaft, down and medially, in degrees"},
  bow = {4000, Min 300, Max 100000, Step 50, Name "bow", Label "Radius of the shaft's bow, forward, in mm"},
  cut = {130, Min 110, Max 250, Step 5, Name "cut", Label "Of the shaft, below the head's centre, in mm"},
  left = {0, Choices {0, 1}, Name "left", Label "A left femur instead of a right one"}
];

If (Max(neck_width, neck_height) > 1.9 * head_radius)
  Error("the neck, %g by %g mm, is thicker than the head, of radius %g mm, can bear: at most %g mm would be right", neck_width, neck_height, head_radius, 1.9 * head_radius);
  Abort;
EndIf

degree = Pi / 180;
side = 1 - 2 * left;

// The axes of neck and shaft cross at C; the neck points from there to the head, by `tilt` from the vertical.
reach = offset / Sin((180 - neck_shaft_angle) * degree);
inclination = (180 - neck_shaft_angle - lean) * degree;
Cx = reach * Sin(inclination);
Cy = -Cx * Tan(version * degree);
Cz = -reach * Cos(inclination);
neck = Sqrt(Cx * Cx + Cy * Cy + Cz * Cz);
tilt = Acos(-Cz / neck);
turn = Atan2(-Cy, Cx);
bend = 0.25 * neck; // on either axis from C on, where one becomes the other

// The shaft's axis at a depth below C: it leans medially, and bows forward about a point 160 mm below.
Macro OnShaft
  px = Cx - depth * Sin(lean * degree);
  py = Cy + (160 * 160 - (160 - depth) * (160 - depth)) / (2 * bow);
  pz = Cz - depth * Cos(lean * degree);
Return

// An oval of half axes a, from side to side, and b about (px, py, pz), its normal tilted medially and turned forward.
wires[] = {};
Macro Oval
  curve = newreg;
  Circle(curve) = {0, 0, 0, 1, 0, 2 * Pi};
  Dilate {{0, 0, 0}, {a, b, 1}} { Curve{curve}; }
  Rotate {{0, 1, 0}, {0, 0, 0}, -side * tilted} { Curve{curve}; }
  Rotate {{0, 0, 1}, {0, 0, 0}, -side * turned} { Curve{curve}; }
  Translate {side * px, py, pz} { Curve{curve}; }
  loop = newreg;
  Curve Loop(loop) = {curve};
  wires[] += {loop};
Return

// The shaft, from the cut to where the bend begins, and wider towards there.
tilted = -lean * degree;
turned = 0;
shaft = (cut + Cz) / Cos(lean * degree);
pieces = Ceil((shaft - bend) / 14);
For i In {0 : pieces - 1}
  depth = shaft - (shaft - bend) * i / pieces;
  wider = Max(0, 1 - (depth - bend) / 40)^2;
  Call OnShaft;
  a = (1 + 0.45 * wider) * shaft_width / 2;
  b = (1 + 0.17 * wider) * shaft_depth / 2;
  Call Oval;
EndFor

// The bend, on a parabola from the shaft's axis to the neck's.
depth = bend;
Call OnShaft;
bx = px;
by = py;
bz = pz;
For i In {0 : 2}
  share = i / 2;
  px = (1 - share)^2 * bx + 2 * share * (1 - share) * Cx + share^2 * (1 - bend / neck) * Cx;
  py = (1 - share)^2 * by + 2 * share * (1 - share) * Cy + share^2 * (1 - bend / neck) * Cy;
  pz = (1 - share)^2 * bz + 2 * share * (1 - share) * Cz + share^2 * (1 - bend / neck) * Cz;
  tilted = share * tilt - (1 - share) * lean * degree;
  turned = share * turn;
  a = (1 - share) * 1.45 * shaft_width / 2 + share * 1.15 * neck_height / 2 + share * (1 - share) * 6;
  b = (1 - share) * 1.17 * shaft_depth / 2 + share * 1.17 * neck_width / 2 + share * (1 - share) * 4;
  Call Oval;
EndFor

// The neck, narrowest outside the head, and into it.
away[] = {1.25, 0.85, 0.3}; // from the head's centre, in its radii
sizes[] = {1, 1.02, 0.95};
tilted = tilt;
turned = turn;
For i In {0 : 2}
  px = away[i] * head_radius / neck * Cx;
  py = away[i] * head_radius / neck * Cy;
  pz = away[i] * head_radius / neck * Cz;
  a = sizes[i] * neck_height / 2;
  b = sizes[i] * neck_width / 2;
  Call Oval;
EndFor
ThruSections(1) = wires[];

Sphere(2) = {0, 0, 0, head_radius}; // one of its poles in the neck, its seam aside from that of the loft
Rotate {{0, 0, 1}, {0, 0, 0}, Pi / 2} { Volume{2}; }
Rotate {{0, 1, 0}, {0, 0, 0}, -side * tilt} { Volume{2}; }
Rotate {{0, 0, 1}, {0, 0, 0}, -side * turn} { Volume{2}; }

// The greater trochanter leans backward; its tip is above the shaft's axis and behind it.
gx = Cx + 8;
gy = Cy - 3;
gz = Cz + 17;
Sphere(3) = {0, 0, 0, 1};
Dilate {{0, 0, 0}, {15, 17, 28}} { Volume{3}; }
Rotate {{1, 0, 0}, {0, 0, 0}, 28 * degree} { Volume{3}; }
Rotate {{0, 1, 0}, {0, 0, 0}, -side * 6 * degree} { Volume{3}; }
Translate {side * gx, gy, gz} { Volume{3}; }

// The lesser trochanter, medially and behind.
depth = 24;
Call OnShaft;
Sphere(4) = {0, 0, 0, 1};
Dilate {{0, 0, 0}, {11, 8, 12}} { Volume{4}; }
Rotate {{0, 0, 1}, {0, 0, 0}, side * 25 * degree} { Volume{4}; }
lx = px - shaft_width / 2;
ly = py - 5;
lz = pz;
Translate {side * lx, ly, lz} { Volume{4}; }

bone = 5;
BooleanUnion(bone) = { Volume{1}; Delete; }{ Volume{2, 3, 4}; Delete; };

// Which surface is which: what is left of the head and of the trochanters, and the cut, each in its box.
whole() = Boundary{ Volume{bone}; };
h = head_radius + 0.5;
head() = Surface In BoundingBox {-h, -h, -h, h, h, h};
greater() = Surface In BoundingBox {side * gx - 36, gy - 42, gz - 41, side * gx + 36, gy + 42, gz + 41};
lesser() = Surface In BoundingBox {side * lx - 22, ly - 20, lz - 16, side * lx + 22, ly + 20, lz + 16};
distal() = Surface In BoundingBox {-200, -200, -cut - 20, 200, 200, -cut + 20};
surface() = Abs(whole());
surface() -= distal();

Physical Volume("bone", 1) = {bone};
Physical Surface("surface", 2) = {surface()};
Physical Surface("head", 3) = {head()};
Physical Surface("trochanter", 4) = {greater()};
Physical Surface("lesser trochanter", 5) = {lesser()};
Physical Surface("distal", 6) = {distal()};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.RandomSeed = 1;
Mesh.Optimize = 1;
