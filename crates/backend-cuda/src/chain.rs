//! Kernels and events that are submitted at once, as a CUDA graph: the device never waits for the host in between, which is
//! what a stage's time would otherwise have in it.

use std::{ffi::c_void, ptr, sync::Arc};

use cloth_core::Result;
use cudarc::driver::{result, sys};

use crate::{
    device::{Device, Kernel},
    fault::DriverResult,
    queue::{Launch, Queue},
};

/// What is done after the link before is done.
pub(crate) enum Link<'a> {
    /// A kernel, and where its arguments lie.
    Kernel { kernel: Kernel, launch: Launch, arguments: &'a mut [*mut c_void] },
    /// An event is recorded.
    Event(sys::CUevent),
}

/// What of a link stays the same from one submission to the next.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Kernel(Kernel, Launch),
    Event,
}

impl Link<'_> {
    const fn form(&self) -> Form {
        match self {
            Self::Kernel { kernel, launch, .. } => Form::Kernel(*kernel, *launch),
            Self::Event(_) => Form::Event,
        }
    }
}

/// A chain of links, kept for the next time that one of the same form is submitted.
#[derive(Default)]
pub(crate) struct Chain {
    graph: Option<Graph>,
}

/// A graph, ready to be launched.
struct Graph {
    device: Arc<Device>,
    forms: Vec<Form>,
    nodes: Vec<sys::CUgraphNode>,
    graph: sys::CUgraph,
    executable: sys::CUgraphExec,
}

// SAFETY: a graph may be used from any thread, one at a time, that has made its context current, which every use does.
unsafe impl Send for Graph {}

/// A kernel as a node of a graph.
fn parameters(
    kernel: Kernel,
    launch: Launch,
    arguments: &mut [*mut c_void],
) -> sys::CUDA_KERNEL_NODE_PARAMS {
    sys::CUDA_KERNEL_NODE_PARAMS {
        func: kernel.0,
        gridDimX: launch.blocks,
        gridDimY: 1,
        gridDimZ: 1,
        blockDimX: launch.threads,
        blockDimY: 1,
        blockDimZ: 1,
        sharedMemBytes: launch.shared as u32,
        kernelParams: arguments.as_mut_ptr(),
        extra: ptr::null_mut(),
        kern: ptr::null_mut(),
        ctx: ptr::null_mut(),
    }
}

impl Chain {
    /// Hands over links, each of which waits for the one before.
    ///
    /// # Errors
    /// `DeviceLost`.
    ///
    /// # Safety
    /// As `Queue::launch`, for each of the kernels; events are alive until the queue is synchronised.
    pub(crate) unsafe fn submit(&mut self, queue: &Queue, links: &mut [Link<'_>]) -> Result<()> {
        queue.device.bind()?;
        let has_form = |graph: &Graph| graph.forms.iter().copied().eq(links.iter().map(Link::form));
        let graph = match &mut self.graph {
            Some(graph) if has_form(graph) => {
                // SAFETY: what the caller promises.
                unsafe { graph.update(links) }?;
                graph
            }
            graph => {
                if graph.is_some() {
                    // It may still run.
                    queue.synchronize()?;
                }
                // SAFETY: what the caller promises.
                graph.insert(unsafe { Graph::new(&queue.device, links) }?)
            }
        };
        // SAFETY: both are alive.
        unsafe { result::graph::launch(graph.executable, queue.stream()) }.engine()
    }
}

impl Graph {
    /// # Safety
    /// As `Chain::submit`.
    unsafe fn new(device: &Arc<Device>, links: &mut [Link<'_>]) -> Result<Self> {
        let mut graph = Self {
            device: Arc::clone(device),
            forms: links.iter().map(Link::form).collect(),
            nodes: Vec::new(),
            graph: ptr::null_mut(),
            executable: ptr::null_mut(),
        };
        // SAFETY: it is destroyed when this is dropped.
        unsafe { sys::cuGraphCreate(&mut graph.graph, 0) }.result().engine()?;
        for link in links {
            // SAFETY: what the caller promises.
            let node = unsafe { graph.node(link) }?;
            graph.nodes.push(node);
        }
        let flags = sys::CUgraphInstantiate_flags(0);
        // SAFETY: the graph is whole.
        graph.executable = unsafe { result::graph::instantiate(graph.graph, flags) }.engine()?;
        Ok(graph)
    }

    /// A node that waits for the last one.
    ///
    /// # Safety
    /// As `Chain::submit`.
    unsafe fn node(&self, link: &mut Link<'_>) -> Result<sys::CUgraphNode> {
        let mut node = ptr::null_mut();
        let last = self.nodes.last().map_or(ptr::null(), ptr::from_ref);
        let before = usize::from(!last.is_null());
        match link {
            Link::Event(event) => {
                // SAFETY: what the caller promises.
                unsafe {
                    sys::cuGraphAddEventRecordNode(&mut node, self.graph, last, before, *event)
                }
                .result()
                .engine()?;
            }
            Link::Kernel { kernel, launch, arguments } => {
                let parameters = parameters(*kernel, *launch, arguments);
                // SAFETY: what the caller promises; the driver takes a copy of the arguments.
                unsafe {
                    sys::cuGraphAddKernelNode_v2(&mut node, self.graph, last, before, &parameters)
                }
                .result()
                .engine()?;
                let value =
                    sys::CUkernelNodeAttrValue { cooperative: i32::from(launch.cooperative) };
                let attribute = sys::CUkernelNodeAttrID::CU_LAUNCH_ATTRIBUTE_COOPERATIVE;
                // SAFETY: the node was just made.
                unsafe { sys::cuGraphKernelNodeSetAttribute(node, attribute, &value) }
                    .result()
                    .engine()?;
            }
        }
        Ok(node)
    }

    /// Takes the arguments and events of links of its form.
    ///
    /// # Safety
    /// As `Chain::submit`.
    unsafe fn update(&mut self, links: &mut [Link<'_>]) -> Result<()> {
        for (&node, link) in self.nodes.iter().zip(links) {
            match link {
                Link::Event(event) => {
                    // SAFETY: what the caller promises.
                    unsafe {
                        sys::cuGraphExecEventRecordNodeSetEvent(self.executable, node, *event)
                    }
                }
                Link::Kernel { kernel, launch, arguments } => {
                    let parameters = parameters(*kernel, *launch, arguments);
                    // SAFETY: what the caller promises; the driver takes a copy of the arguments.
                    unsafe {
                        sys::cuGraphExecKernelNodeSetParams_v2(self.executable, node, &parameters)
                    }
                }
            }
            .result()
            .engine()?;
        }
        Ok(())
    }
}

impl Drop for Graph {
    fn drop(&mut self) {
        if self.device.bind().is_err() {
            return;
        }
        if !self.executable.is_null() {
            // SAFETY: it is used by nobody else.
            let _ = unsafe { result::graph::exec_destroy(self.executable) };
        }
        if !self.graph.is_null() {
            // SAFETY: as above.
            let _ = unsafe { result::graph::destroy(self.graph) };
        }
    }
}
