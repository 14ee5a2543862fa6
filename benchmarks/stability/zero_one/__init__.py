"""The paper's Remark 6.1 and Fig. 12: the femur with m = 0 on its way to a field of zeros and ones."""
