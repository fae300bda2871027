"""How often intervals hold the truth beside a keyway; writes into the working folder.

    python benchmarks/keyway/coverage.py RUNOUT 40 linear benchmarks/keyway/scenario.toml

Needs NumPy, SciPy and h5py. Columns decl: up to the declared edges; val: up to those of the values.
"""
import subprocess,sys,json,numpy as np,h5py,os
from scipy.interpolate import CubicSpline
R=sys.argv[1]; N=int(sys.argv[2]); way=sys.argv[3] if len(sys.argv)>3 else 'linear'
GAP=sys.argv[5] if len(sys.argv)>5 else 'interruptions = [{ from_deg = 351.5, to_deg = 4.5 }]'
rig=open(sys.argv[4]).read(); rig=rig[rig.index('[rig]'):rig.index('[recording]')]
pipe='title="k"\n'+rig+'''%s
[load]
plugin = "hdf5"
path = "rec.h5"
[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 512
[separate]
plugin = "harmonic-least-squares"
[evaluate]
values = ["roundness"]
references = ["LSCI", "MZCI"]
filter_upr = [50]
uncertainty = "%s"
[[export]]
plugin = "json"
path = "out.json"
'''%(GAP,way)
pipe=pipe.replace('[[export]]\nplugin = "json"\npath = "out.json"\n','[[export]]\nplugin = "parquet"\npath = "out"\n')
open('p.toml','w').write(pipe)
def lsci(th,r):
    A=np.c_[np.ones_like(th),np.cos(th),np.sin(th)]
    return r-A@np.linalg.lstsq(A,r,rcond=None)[0]
res={}
for seed in range(N):
    sc=open(sys.argv[4]).read().replace('seed = 3',f'seed = {100+seed}')
    open('s.toml','w').write(sc)
    subprocess.run([R,'simulate','s.toml','--out','rec.h5'],check=True,stdout=subprocess.DEVNULL,stderr=subprocess.DEVNULL)
    subprocess.run([R,'run','p.toml','--threads','1'],check=True,stdout=subprocess.DEVNULL,stderr=subprocess.DEVNULL)
    s=json.load(open('out/summary.json'))
    f=h5py.File('rec.h5')
    for st in s['stations']:
        for sec in st['sections']:
            form=f[f"truth/{st['station']}/form_um/{sec['section']}"][:]
            n=len(form); th=np.arange(n)*2*np.pi/n
            ok=(np.degrees(th)>4.05)&(np.degrees(th)<351.95)
            cs=CubicSpline(th[ok],form[ok]) if GAP else CubicSpline(np.r_[th,2*np.pi],np.r_[form,form[0]],bc_type='periodic')
            for tag,w in (('decl',0.0),('val',None)):
                for v in sec['values']:
                    if v['reference']!='LSCI' or v['filter']!='none': continue
                    if v['symbol'] not in('RONt','RONq','RONp','RONv'): continue
                    if not GAP: a,b=0,2*np.pi;ww=0
                    elif w is None: ww=0.3516
                    else: ww=0
                    if GAP: a,b=np.radians(4.5+ww),np.radians(351.5-ww)
                    x=np.linspace(a,b,16384,endpoint=bool(GAP)); d=lsci(x,cs(x))
                    t={'RONt':d.max()-d.min(),'RONq':np.sqrt((d**2).mean()),'RONp':d.max(),'RONv':-d.min()}[v['symbol']]
                    u=v['uncertainty']; i=u['interval_95']
                    res.setdefault((tag,v['symbol']),[]).append(((v['value']-t),u['std'],i[0]<=t<=i[1],ww, t<i[0]))
for k,v in sorted(res.items()):
    e=np.array([x[0] for x in v]);s=np.array([x[1] for x in v]);print(k,len(v),'holds %.1f%%'%(100*np.mean([x[2] for x in v])),'rms err %.5f'%np.sqrt((e**2).mean()),'mean %.5f'%e.mean(),'std stated %.5f'%np.sqrt((s**2).mean()),'ww %.3f'%np.mean([x[3] for x in v]),'below %d'%sum(x[4] for x in v))
