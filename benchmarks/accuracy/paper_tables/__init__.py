"""The paper's tables and pictures beside ours: the bars, the femur, and the page about both."""
