BEGIN Y.COM MM
NR      AXISPOS         Y               X1
0       0.00000         0.00300         -0.00200
1       100.00000       -0.00300        0.00200
[END]
