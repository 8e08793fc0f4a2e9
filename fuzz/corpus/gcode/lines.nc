% 
(to the first field, then back)
N10 G21 G90 G94 F600
N20 G0 X10 Y-2.5
G1 X12.5 F1200.5 ; on
X0 Y0
G91 X.1
X-.1 Y+0.05
G80
M30
%
