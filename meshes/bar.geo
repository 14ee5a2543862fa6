// Bar [0, 1] x width 0.01, symmetric about y = 0: one row of cells along x.
// Parameters are set in the gmsh window, with gmsh -setnumber elements 10 or by growthx.meshing.read(..., elements=10).

DefineConstant[
  elements = {40, Min 1, Step 1, Name "elements", Label "Cells along the bar"},
  taper = {1, Min 0.01, Max 1, Step 0.1, Name "taper", Label "Width at mid-length / width at the ends"},
  triangles = {0, Choices {0, 1}, Name "triangles", Label "Triangles instead of quadrilaterals"}
];

length = 1;
half_width = 0.01 / 2;

Point(1) = {0, -half_width, 0};
Point(2) = {length, -half_width, 0};
Point(3) = {length, half_width, 0};
Point(4) = {0, half_width, 0};

If (elements != Floor(elements))
  Error("%g elements: a whole number would be right", elements);
  Abort;
EndIf

If (taper == 1)
  Line(1) = {1, 2};
  Line(3) = {3, 4};
  bottom[] = {1};
  top[] = {3};
Else
  // The kink at mid-length is a mesh line, so each half takes the same number of cells.
  If (elements % 2 != 0)
    Error("a tapered bar of %g elements has no mesh line at mid-length: an even number would be right", elements);
    Abort;
  EndIf
  Point(5) = {length / 2, -half_width * taper, 0};
  Point(6) = {length / 2, half_width * taper, 0};
  Line(11) = {1, 5};
  Line(12) = {5, 2};
  Line(13) = {3, 6};
  Line(14) = {6, 4};
  bottom[] = {11, 12};
  top[] = {13, 14};
EndIf
Line(2) = {2, 3};
Line(4) = {4, 1};

Curve Loop(1) = {bottom[], 2, top[], 4};
Plane Surface(1) = {1};

Transfinite Curve {bottom[], top[]} = elements / #bottom[] + 1;
Transfinite Curve {2, 4} = 2;
Transfinite Surface {1} = {1, 2, 3, 4} Alternated;
If (!triangles)
  Recombine Surface {1};
EndIf

Physical Surface("bar") = {1};
Physical Curve("left") = {4};
Physical Curve("right") = {2};
