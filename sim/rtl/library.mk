# Verilator's rules for its runtime, and one compilation for the axis with its shim: the headers of Verilator, which take
# as long to read as the code of an axis, are read once.

include Vaxis.mk
CXXFLAGS += -fPIC

libaxis.so: ../library.cpp Vaxis__ALL.cpp $(VK_GLOBAL_OBJS)
	$(CXX) $(CXXFLAGS) $(CPPFLAGS) $(OPTIMISATION) -shared -o $@ $< $(VK_GLOBAL_OBJS) $(LDFLAGS) $(LDLIBS)
