// Proximal femur in space with a bonded stem, lengths in mm.  The bone is that of femur3d.geo with all of its parameters,
// cut across the neck; the stem follows the axes of shaft and neck from its tip to the cut and bears a head where the
// femur has its own.
// Parameters are set in the gmsh window, with gmsh -setnumber size 3 or by growthx.meshing.read(..., size=3).

DefineConstant[
  cut = {170, Min 110, Max 250, Step 5, Name "cut", Label "Of the shaft, below the head's centre, in mm"}
];
Include "femur3d.geo";
Delete Physicals;

DefineConstant[
  tip = {100, Min 60, Max 240, Step 5, Name "tip", Label "Of the stem, below the head's centre, in mm"},
  width = {12, Min 2, Max 40, Step 0.5, Name "width", Label "Of the stem at its tip in mm"},
  flare = {2.1, Min 1, Max 4, Step 0.1, Name "flare", Label "Width of the stem at the neck, in widths at its tip"},
  stem_head = {14, Min 10, Max 18, Step 1, Name "stem_head", Label "Radius of the stem's head in mm"},
  resection = {0.7, Min 0.4, Max 0.8, Step 0.05, Name "resection", Label "From the head's centre, in lengths of the neck"},
  natural = {0, Choices {0, 1}, Name "natural", Label "The femur's own head and neck are one piece with the stem"}
];
If (stem_head > head_radius - 2)
  Error("the stem's head, of a radius of %g mm, is not in that of the femur, of %g mm: at most %g mm would be right", stem_head, head_radius, head_radius - 2);
  Abort;
EndIf

// The stem, from its tip up the shaft to the bend, round it and into the neck, beyond the cut.
wires[] = {};
tilted = -lean * degree;
turned = 0;
below = (tip + Cz) / Cos(lean * degree); // depth of the tip
If (below < bend + 10)
  Error("the stem's tip, %g mm below the head's centre, is beside its shoulder: at least %g mm would be right", tip, (bend + 10) * Cos(lean * degree) - Cz);
  Abort;
EndIf
For i In {0 : 2}
  depth = below - (below - bend) * i / 2;
  Call OnShaft;
  a = width / 2 * (1 + (flare - 1) * 0.6 * (i / 2)^2);
  b = width / 2 * (1 + 0.1 * i);
  Call Oval;
EndFor
For i In {1 : 2}
  share = i / 2;
  depth = bend;
  Call OnShaft;
  bx = px;
  by = py;
  bz = pz;
  px = (1 - share)^2 * bx + 2 * share * (1 - share) * Cx + share^2 * (1 - bend / neck) * Cx;
  py = (1 - share)^2 * by + 2 * share * (1 - share) * Cy + share^2 * (1 - bend / neck) * Cy;
  pz = (1 - share)^2 * bz + 2 * share * (1 - share) * Cz + share^2 * (1 - bend / neck) * Cz;
  tilted = share * tilt - (1 - share) * lean * degree;
  turned = share * turn;
  a = width / 2 * flare;
  b = width / 2 * 1.2;
  Call Oval;
EndFor
px = (resection - 0.1) * Cx;
py = (resection - 0.1) * Cy;
pz = (resection - 0.1) * Cz;
Call Oval;
inside = newv;
ThruSections(inside) = wires[];

// What goes with the head is above a plane across the neck, the lower side of a box, as far as beside the stem's
// shoulder: the trochanter stays.
gone = newv;
Box(gone) = {-100, -100, -resection * neck, 200, 200, 200};
Rotate {{0, 1, 0}, {0, 0, 0}, -side * tilt} { Volume{gone}; }
Rotate {{0, 0, 1}, {0, 0, 0}, -side * turn} { Volume{gone}; }
aside = newv;
Box(aside) = {side > 0 ? resection * Cx + width / 2 * flare * Cos(tilt) + 1 : -400 - resection * Cx - width / 2 * flare * Cos(tilt) - 1, -200, -200, 400, 400, 400};
whole() = Mass Volume{bone};
body = newv;
BooleanDifference(body) = { Volume{inside}; Delete; }{ Volume{gone}; };
above = newv;
BooleanDifference(above) = { Volume{gone}; Delete; }{ Volume{aside}; Delete; };
rest = newv;
BooleanDifference(rest) = { Volume{bone}; }{ Volume{above}; };
off = newv;
BooleanIntersection(off) = { Volume{bone}; Delete; }{ Volume{above}; Delete; };

// Nothing of the stem may come out of the bone, but through the cut.
out() = BooleanDifference{ Volume{body}; }{ Volume{rest}; };
beyond = 0;
For i In {0 : #out() - 1}
  mass() = Mass Volume{out(i)};
  beyond += mass(0);
EndFor
If (beyond > 0.1)
  Error("the stem, %g mm wide at its tip %g mm below the head's centre and %g times as wide at the neck, lies outside the bone by %g mm3: a thinner or shorter one would be right", width, tip, flare, beyond);
  Abort;
EndIf

// A neck from the cut to the stem's head, both where the femur has its own.
ball = newv;
Sphere(ball) = {0, 0, 0, stem_head};
Rotate {{0, 0, 1}, {0, 0, 0}, Pi / 2} { Volume{ball}; }
Rotate {{0, 1, 0}, {0, 0, 0}, -side * tilt} { Volume{ball}; }
Rotate {{0, 0, 1}, {0, 0, 0}, -side * turn} { Volume{ball}; }
cone = newv;
fx = side * resection * Cx;
fy = resection * Cy;
fz = resection * Cz;
Cone(cone) = {fx, fy, fz, -fx, -fy, -fz, 6.5, 6};
upper = newv;
BooleanUnion(upper) = { Volume{ball}; Delete; }{ Volume{cone}; Delete; };

// All in one mesh, whatever is taken of it: the intact femur has the same cells.  Its parts are known by their volumes.
sizes[] = {};
four[] = {rest, body, upper, off};
For i In {0 : 3}
  mass() = Mass Volume{four[i]};
  sizes[] += {mass(0)};
EndFor
sizes[0] -= sizes[1];
sizes[3] -= sizes[2];
parts() = BooleanFragments{ Volume{rest, off}; Delete; }{ Volume{body, upper}; Delete; };
missed = 0;
For i In {0 : #parts() - 1}
  mass() = Mass Volume{parts(i)};
  missed += mass(0);
EndFor
If (#parts() != 4 || Fabs(missed - whole(0)) > 2e-4 * whole(0))
  Error("the stem parts the femur in %g instead of 4, of %g instead of %g mm3: a thinner or shorter one would be right", #parts(), missed, whole(0));
  Abort;
EndIf
For i In {0 : 3}
  least = 1e9;
  For j In {0 : 3}
    mass() = Mass Volume{parts(j)};
    If (Fabs(mass(0) - sizes[i]) < least)
      least = Fabs(mass(0) - sizes[i]);
      four[i] = parts(j);
    EndIf
  EndFor
EndFor
cells() = {four[1], four[2]};
If (natural)
  cells() += {four[3]};
EndIf

// Which surface is which, as in femur3d.geo; the interface is what bone and stem have in common.
outer() = Abs(CombinedBoundary{ Volume{parts()}; });
cut_off() = Abs(Boundary{ Volume{four[3]}; });
outer() -= cut_off();
whole() = Abs(CombinedBoundary{ Volume{four[0], cells()}; });
beside() = Abs(Boundary{ Volume{four[0]}; });
beside() -= Abs(Boundary{ Volume{four[1], four[2]}; });
interface() = Abs(Boundary{ Volume{four[0]}; });
interface() -= beside();
h = (natural ? head_radius : stem_head) + 0.5;
head() = Surface In BoundingBox {-h, -h, -h, h, h, h};
inner() = head();
inner() -= whole();
head() -= inner();
greater() = Surface In BoundingBox {side * gx - 36, gy - 42, gz - 41, side * gx + 36, gy + 42, gz + 41};
inner() = greater();
inner() -= outer();
greater() -= inner();
lesser() = Surface In BoundingBox {side * lx - 22, ly - 20, lz - 16, side * lx + 22, ly + 20, lz + 16};
inner() = lesser();
inner() -= outer();
lesser() -= inner();
distal() = Surface In BoundingBox {-200, -200, -cut - 20, 200, 200, -cut + 20};
inner() = distal();
inner() -= outer();
distal() -= inner();
surface() = whole();
surface() -= distal();

Physical Volume("bone", 1) = {four[0]};
Physical Volume("stem", 2) = {cells()};
Physical Surface("surface", 2) = {surface()};
Physical Surface("head", 3) = {head()};
Physical Surface("trochanter", 4) = {greater()};
Physical Surface("lesser trochanter", 5) = {lesser()};
Physical Surface("distal", 6) = {distal()};
Physical Surface("interface", 7) = {interface()};
