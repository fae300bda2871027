0.000000 -0.004000 -0.004000
100.000000 100.001000 100.001000
200.000000 200.003000 200.003000
# linuxcnc: Test machine
# runout test, not tried on a real control: check the sign with one axis at low speed
# COMP_FILE_TYPE = 0: nominal, forward and reverse position, in mm or °, of a machine in these units
# forward and reverse are equal: the curves do not tell directions apart; BACKLASH is ignored beside COMP_FILE
# left out: EYX EZX EAX EBX ECX EXY EYY EBY EZZ EC0Y EB0Z EA0Z
# not observable, 0 here: ECY EAZ EBZ ECZ
# expected rms error over the volume, less the rigid motion that fits best: before 3.246 um, after 2.507 um; 0.000 um of both is not known, or no axis takes it away
