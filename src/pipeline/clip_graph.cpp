#include "pipeline/clip_graph.h"

#include <tbb/flow_graph.h>

#include "pipeline/clip_in_flight.h"

namespace batchenc {

void run_clip_graph(const ClipStages& stages, int tokens) {
    using namespace tbb::flow;
    using Clip = std::shared_ptr<ClipInFlight>;
    using Stage = function_node<Clip, Clip>;
    const auto pass_through = [](const std::function<void(ClipInFlight&)>& stage) {
        return [&stage](Clip clip) {
            stage(*clip);
            return clip;
        };
    };

    graph g;
    input_node<Clip> feed(g, [&](tbb::flow_control& control) {
        Clip clip = stages.next();
        if (!clip) control.stop();
        return clip;
    });
    // One clip more than there are tokens exists: the one that waits in `feed`. It has nothing allocated yet.
    limiter_node<Clip> admit(g, static_cast<std::size_t>(tokens));
    Stage read(g, serial, pass_through(stages.read));
    Stage segment(g, unlimited, pass_through(stages.segment));
    Stage code(g, unlimited, pass_through(stages.code));
    Stage verify(g, unlimited, pass_through(stages.verify));
    sequencer_node<Clip> in_order(g, [](const Clip& clip) { return static_cast<std::size_t>(clip->number); });
    function_node<Clip, continue_msg> write(g, serial, [&](const Clip& clip) {
        stages.write(*clip);
        return continue_msg();
    });

    make_edge(feed, admit);
    make_edge(admit, read);
    make_edge(read, segment);
    make_edge(segment, code);
    make_edge(code, verify);
    make_edge(verify, in_order);
    make_edge(in_order, write);
    make_edge(write, admit.decrementer());
    feed.activate();
    g.wait_for_all();
}

}  // namespace batchenc
